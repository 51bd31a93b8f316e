#include "core/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace coral {
namespace {

bool quiet_process = false;

bool terminal()
{
    const char* kind = std::getenv("TERM");
    return ::isatty(STDERR_FILENO) && kind && std::string_view(kind) != "dumb";
}

std::string duration(double seconds)
{
    char text[32];
    if (seconds < 60) {
        std::snprintf(text, sizeof text, "%.0f s", seconds);
    } else if (seconds < 3600) {
        std::snprintf(text, sizeof text, "%.0f min %02.0f s", std::floor(seconds / 60), std::fmod(seconds, 60));
    } else {
        std::snprintf(text, sizeof text, "%.1f h", seconds / 3600);
    }
    return text;
}

double seconds_between(std::chrono::steady_clock::time_point a, std::chrono::steady_clock::time_point b)
{
    return std::chrono::duration<double>(b - a).count();
}

}  // namespace

Progress::Progress(std::string what, double total, double done)
    : what_(std::move(what)), total_(total), first_(total > 0 ? std::clamp(done / total, 0.0, 1.0) : 0), tenth_(int(first_ * 10)), start_(std::chrono::steady_clock::now()),
      last_(start_)
{
}

Progress::~Progress() { finish(); }

void Progress::set_quiet(bool quiet) { quiet_process = quiet; }

void Progress::update(double done, const std::string& detail)
{
    if (quiet_process || finished_ || total_ <= 0) return;
    const auto now = std::chrono::steady_clock::now();
    const double share = std::clamp(done / total_, 0.0, 1.0);
    const double elapsed = seconds_between(start_, now);
    const bool redraw = terminal();
    if (redraw ? seconds_between(last_, now) < 0.1 && share < 1 : static_cast<int>(share * 10) <= tenth_) return;
    last_ = now;
    tenth_ = static_cast<int>(share * 10);
    const std::string left = share > first_ && elapsed > 0.5 ? ", " + duration(elapsed * (1 - share) / (share - first_)) + " left" : "";
    std::fprintf(stderr, "%s%s %3.0f %%%s%s%s%s", redraw ? "\r\033[K" : "", what_.c_str(), 100 * share, left.c_str(),
                 detail.empty() ? "" : ", ", detail.c_str(), redraw ? "" : "\n");
    std::fflush(stderr);
}

void Progress::finish()
{
    if (finished_) return;
    finished_ = true;
    if (!quiet_process && terminal()) std::fputs("\r\033[K", stderr);
}

}  // namespace coral
