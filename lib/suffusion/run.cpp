#include "suffusion/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/text.h"
#include "suffusion/checkpoint.h"
#include "suffusion/frame_writer.h"
#include "suffusion/observables.h"
#include "suffusion/performance.h"

namespace coral::suffusion {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double results_seconds = 10;  ///< wall time between rewrites of results.h5, at least
constexpr double writing_share = 0.02;  ///< of the wall time may go into rewrites, of results and of checkpoints each
constexpr double keeping_share = 0.02;  ///< of the wall time may go into copies of the state

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Multiples of an interval, without the drift of repeated addition.
class Schedule {
public:
    Schedule(double interval, double end) : interval_(interval), end_(end) {}
    /// First instant after `time`; the end of the run counts as one, and swallows a multiple that rounding puts beside it.
    double next(double time) const
    {
        if (interval_ <= 0) return end_;
        double k = std::floor(time / interval_ + 1e-9) + 1;
        return k * interval_ < end_ - 1e-9 * interval_ ? k * interval_ : end_;
    }
    bool due(double time) const
    {
        if (interval_ <= 0) return false;
        return time >= end_ || std::abs(time / interval_ - std::round(time / interval_)) < 1e-9;
    }

private:
    double interval_, end_;
};

/// A plate that reaches into the cells at an outlet exchanges momentum with what leaves: the balance of the run does not close there.
bool plate_at_outlet(const Case& c)
{
    const WallSpec* plate = c.plate();
    return plate && c.domain && c.boundary[4].kind == BoundaryKind::outlet && plate->z - plate->thickness < c.domain->origin.z() + c.domain->cell;
}

class Run {
public:
    Run(const fs::path& path, const RunOptions& options);
    RunSummary execute();

private:
    void start_or_resume();
    void resume(const Checkpoint& checkpoint);
    void loop(RunSummary& summary);
    void keep_state();
    void at_event();
    void write_results_now();
    Checkpoint present_checkpoint() const;
    void write_checkpoint_now(const std::vector<std::uint8_t>& state);
    void stop_on_error();
    void finish(RunSummary& summary);

    RunOptions options_;
    fs::path folder_, results_file_, checkpoint_file_;
    Clock::time_point start_ = Clock::now(), last_checkpoint_ = start_, last_results_ = start_;
    Clock::time_point last_kept_ = start_;
    double checkpoint_cost_ = 0, results_cost_ = 0, keeping_cost_ = 0;
    Simulation simulation_;
    Observer observer_;
    FrameWriter frames_;
    Schedule output_, frame_;
    std::vector<Measure> earlier_;             ///< performance of the parts before a resume
    std::vector<std::uint8_t> last_good_;      ///< state at one of the last outputs
    std::vector<std::uint8_t> last_observer_;
    std::size_t last_rows_ = 0, last_frames_ = 0;
};

Run::Run(const fs::path& path, const RunOptions& options)
    : options_(options), simulation_(build_scene(read_case(path))), observer_(simulation_), frames_(simulation_),
      output_(simulation_.scene().description.output.interval, simulation_.scene().description.time.duration),
      frame_(simulation_.scene().description.output.frames, simulation_.scene().description.time.duration)
{
    folder_ = simulation_.scene().description.folder;
    // A case of its own file name keeps its outputs apart from those of case.toml.
    const std::string stem = fs::is_directory(path) || path.filename() == "case.toml" ? "" : path.stem().string() + ".";
    results_file_ = folder_ / (stem + "results.h5");
    checkpoint_file_ = folder_ / (stem + "checkpoint.h5");
    frames_.set_folder(folder_ / (stem + "frames"));
    History history = simulation_.scene().history;
    history.push_back(options_.record);
    observer_.results().history = to_json(history);
    if (plate_at_outlet(simulation_.scene().description))
        options_.message("the plate lies within a cell of the outlet: the balance of momentum will not close; begin the domain lower");
}

void Run::resume(const Checkpoint& checkpoint)
{
    const Scene& scene = simulation_.scene();
    const std::size_t cells = simulation_.has_flow() ? simulation_.flow().grid().cell_count() : 0;
    if (checkpoint.cells != cells || checkpoint.bodies != scene.bodies.size())
        throw Error(checkpoint_file_.string(), fmt::format("is of another case: {} cells and {} bodies, here {} and {}", checkpoint.cells, checkpoint.bodies, cells, scene.bodies.size()),
                    "put the old case.toml back, or run without --resume");
    Results stored = read_results(results_file_);
    if (stored.case_text != scene.description.text) options_.message("case.toml has changed since the run began; it goes on with the new one");
    earlier_ = stored.performance;
    observer_.resume(std::move(stored), checkpoint.rows, checkpoint.observer);
    simulation_.restore(checkpoint.simulation);
    frames_.resume(checkpoint.frames);
    options_.message(fmt::format("resumed at t = {} s", to_text(checkpoint.time)));
}

void Run::start_or_resume()
{
    if (options_.resume && fs::exists(checkpoint_file_)) {
        resume(read_checkpoint(checkpoint_file_));
        return;
    }
    if (options_.resume) options_.message("there is no checkpoint yet: starting from the beginning");
    else if (fs::exists(results_file_)) options_.message("starting anew: " + results_file_.string() + " is replaced (--resume goes on instead)");
    std::error_code ignored;
    fs::remove(checkpoint_file_, ignored);
    fs::remove(results_file_, ignored);
    frames_.clear();
    observer_.record(simulation_);
    if (frame_.due(0)) frames_.write(simulation_);
}

void Run::write_results_now()
{
    const Clock::time_point begin = Clock::now();
    observer_.results().performance = options_.timing ? performance_of(simulation_, earlier_) : std::vector<Measure>{};
    write_results(results_file_, observer_.results());
    last_results_ = Clock::now();
    results_cost_ = seconds_since(begin);
    simulation_.timing().output += results_cost_;
}

/// What a checkpoint says of the case and the time; who writes it adds the states and how much of the outputs belongs to them.
Checkpoint Run::present_checkpoint() const
{
    Checkpoint checkpoint;
    checkpoint.time = simulation_.time();
    checkpoint.cells = simulation_.has_flow() ? simulation_.flow().grid().cell_count() : 0;
    checkpoint.bodies = simulation_.scene().bodies.size();
    checkpoint.history = observer_.results().history;
    return checkpoint;
}

/// results.h5 first: a checkpoint never counts rows that the file lacks.
void Run::write_checkpoint_now(const std::vector<std::uint8_t>& state)
{
    write_results_now();
    const Clock::time_point begin = Clock::now();
    Checkpoint checkpoint = present_checkpoint();
    checkpoint.rows = observer_.results().rows();
    checkpoint.frames = frames_.count();
    checkpoint.simulation = state;
    checkpoint.observer = observer_.save();
    write_checkpoint(checkpoint_file_, checkpoint);
    last_checkpoint_ = Clock::now();
    checkpoint_cost_ = results_cost_ + seconds_since(begin);
    simulation_.timing().output += seconds_since(begin);
}

/// Copies the state of this output for stop_on_error(); not that of every one, where copying takes more than its share of the time.
void Run::keep_state()
{
    if (!last_good_.empty() && seconds_since(last_kept_) < keeping_cost_ / keeping_share) return;
    const Clock::time_point begin = Clock::now();
    last_good_ = simulation_.save();
    last_observer_ = observer_.save();
    last_rows_ = observer_.results().rows();
    last_frames_ = frames_.count();
    last_kept_ = Clock::now();
    keeping_cost_ = seconds_since(begin);
}

void Run::at_event()
{
    const Clock::time_point begin = Clock::now();
    const double time = simulation_.time();
    if (output_.due(time) || time >= simulation_.scene().description.time.duration) observer_.record(simulation_);
    if (frame_.due(time)) frames_.write(simulation_);
    keep_state();
    simulation_.timing().output += seconds_since(begin);
    if (seconds_since(last_results_) > std::max(results_seconds, results_cost_ / writing_share)) write_results_now();
}

void Run::loop(RunSummary& summary)
{
    const double duration = simulation_.scene().description.time.duration;
    const double end = std::min(duration, options_.until);
    const double checkpoint_seconds = simulation_.scene().description.output.checkpoint;
    Progress progress("suffuse", end, simulation_.time());
    while (simulation_.time() < end * (1 - 1e-12)) {
        const double event = std::min(output_.next(simulation_.time()), frame_.next(simulation_.time()));
        simulation_.step(event);
        observer_.follow(simulation_);
        if (simulation_.time() == event) at_event();
        progress.update(simulation_.time(), fmt::format("step {} of {:.2e} s", simulation_.steps(), simulation_.last_flow_step()));
        if (options_.interrupted()) {
            summary.interrupted = true;
            break;
        }
        if (seconds_since(last_checkpoint_) > std::max(checkpoint_seconds, checkpoint_cost_ / writing_share)) write_checkpoint_now(simulation_.save());
    }
    progress.finish();
}

/// Leaves what was good: the results, and a checkpoint of the last output whose state was kept.
void Run::stop_on_error()
{
    if (last_good_.empty()) return;
    observer_.results().performance = options_.timing ? performance_of(simulation_, earlier_) : std::vector<Measure>{};
    write_results(results_file_, observer_.results());
    simulation_.restore(last_good_);
    Checkpoint checkpoint = present_checkpoint();
    checkpoint.rows = last_rows_;
    checkpoint.frames = last_frames_;
    checkpoint.simulation = last_good_;
    checkpoint.observer = last_observer_;
    write_checkpoint(checkpoint_file_, checkpoint);
    options_.message(fmt::format("results and a checkpoint at t = {} s are kept", to_text(checkpoint.time)));
}

void Run::finish(RunSummary& summary)
{
    const Results& results = observer_.results();
    summary.time = simulation_.time();
    summary.duration = simulation_.scene().description.time.duration;
    summary.complete = summary.time >= summary.duration * (1 - 1e-12);
    summary.results = results_file_;
    summary.checkpoint = checkpoint_file_;
    summary.performance = results.performance;
    summary.bodies = simulation_.scene().bodies.size();
    summary.fines = results.fines.size();
    for (const Column& column : results.series) {
        if (column.width == 1 && !column.values.empty()) summary.last.push_back({column.name, column.unit, column.values.back()});
        if (column.name == "mass_balance_error") summary.max_mass_error = *std::ranges::max_element(column.values);
        if (column.name == "momentum_balance_error") summary.max_momentum_error = *std::ranges::max_element(column.values);
    }
}

RunSummary Run::execute()
{
    RunSummary summary;
    start_or_resume();
    try {
        loop(summary);
    } catch (const UsageError&) {
        throw;
    } catch (const Error&) {
        stop_on_error();
        throw;
    }
    write_checkpoint_now(simulation_.save());
    finish(summary);
    return summary;
}

}  // namespace

RunSummary run_case(const fs::path& path, const RunOptions& options) { return Run(path, options).execute(); }

}  // namespace coral::suffusion
