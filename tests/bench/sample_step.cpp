// Cost of a contact step of a packed sample, phase by phase: sample_step SAMPLE.h5 [steps] [threads] [automatic|nearest|walls].
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string_view>

#include "core/parallel.h"
#include "pack/sample.h"
#include "pack/sample_world.h"

int main(int count, char** values)
{
    using namespace coral;
    if (count < 2) {
        std::fputs("sample_step SAMPLE.h5 [steps] [threads] [automatic|nearest|walls]\n", stderr);
        return 1;
    }
    const int steps = count > 2 ? std::atoi(values[2]) : 2000;
    set_thread_count(count > 3 ? std::atoi(values[3]) : 1);
    const pack::Sample sample = pack::read_sample(values[1], pack::SampleDetail::without_apparent_grids);
    dem::WorldOptions options;
    options.gravity = sample.gravity;
    const std::string_view scheme = count > 4 ? values[4] : "automatic";
    options.sphere_scheme = scheme == "walls" ? dem::SphereScheme::walls : scheme == "nearest" ? dem::SphereScheme::nearest : dem::SphereScheme::automatic;
    dem::World world(options);
    const pack::SampleIds ids = pack::add_sample(world, sample);
    pack::restore_springs(world, sample, ids);
    const double dt = std::min(world.auto_time_step(), 2e-6);
    for (int i = 0; i < 200; ++i) world.step(dt);
    std::printf("%d bodies, %zu shapes, step %.3g s, unbalanced ratio %.2g\n", world.body_count(), sample.shapes.size(), dt, world.statistics().unbalanced_ratio);
    for (int run = 0; run < 3; ++run) {
        const dem::Counters before = world.counters();
        timespec cpu[2], wall[2];
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu[0]);
        clock_gettime(CLOCK_MONOTONIC, &wall[0]);
        for (int i = 0; i < steps; ++i) world.step(dt);
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu[1]);
        clock_gettime(CLOCK_MONOTONIC, &wall[1]);
        const auto ms = [&](const timespec* t) { return 1e3 * (double(t[1].tv_sec - t[0].tv_sec) + 1e-9 * double(t[1].tv_nsec - t[0].tv_nsec)) / steps; };
        const dem::Counters& after = world.counters();
        const auto per_step = [&](auto of) { return double(after.*of - before.*of) / steps; };
        std::printf("step %.4f ms CPU, %.4f ms wall: pairs %.4f, integration %.4f, lists %.4f ms wall; %.0f contacts, %.0f pair tests, %.0f node tests, %.4f rebuilds\n",
                    ms(cpu), ms(wall), 1e3 * per_step(&dem::Counters::seconds_pairs), 1e3 * per_step(&dem::Counters::seconds_integration),
                    1e3 * per_step(&dem::Counters::seconds_lists), per_step(&dem::Counters::contacts), per_step(&dem::Counters::pair_tests),
                    per_step(&dem::Counters::node_tests), per_step(&dem::Counters::rebuilds));
    }
}
