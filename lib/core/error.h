#pragma once
/// \file core/error.h
/// Errors a user can cause. Each says where, what is wrong, and how to put it right, on one line.
#include <stdexcept>
#include <string>
#include <string_view>

namespace coral {

/// The work failed: damaged input, full disk, broken invariant of a run. Tools exit with 1.
class Error : public std::runtime_error {
public:
    /// \param where       file, option, body or line the error belongs to
    /// \param what        what is wrong, with the value found
    /// \param how_to_fix  what the user can do; may be empty
    Error(std::string_view where, std::string_view what, std::string_view how_to_fix = {});
};

/// The command line or a configuration file is wrong. Tools exit with 2.
class UsageError : public Error {
public:
    using Error::Error;
};

}  // namespace coral
