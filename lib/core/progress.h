#pragma once
/// \file core/progress.h
/// Progress on stderr: one redrawn line on a terminal, a plain line per tenth elsewhere, nothing when quiet.
#include <chrono>
#include <string>

namespace coral {

class Progress {
public:
    /// \param total  amount of work in any unit; \param what  short noun shown in front ("settling", "grains")
    /// \param done   what an earlier run did of it: the time left counts from there
    Progress(std::string what, double total, double done = 0);
    ~Progress();
    /// Work done so far; `detail` is shown after rate and time left.
    void update(double done, const std::string& detail = {});
    void finish();

    /// Silences all progress of the process (--quiet).
    static void set_quiet(bool quiet);

private:
    std::string what_;
    double total_, first_;
    int tenth_ = 0;
    bool finished_ = false;
    std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace coral
