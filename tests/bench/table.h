#pragma once
/// \file bench/table.h
/// Error and cost side by side, one aligned line for each setting.
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

namespace coral::bench {

/// Seconds of one call.
template <class Work>
double seconds(const Work& work)
{
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

inline void heading(const std::string& title, const std::vector<std::string>& columns)
{
    std::printf("\n%s\n", title.c_str());
    for (const std::string& column : columns) std::printf("%18s", column.c_str());
    std::printf("\n");
}

inline void line(const std::vector<double>& values)
{
    for (double value : values) std::printf("%18.4g", value);
    std::printf("\n");
    std::fflush(stdout);
}

}  // namespace coral::bench
