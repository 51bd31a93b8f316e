#include "phantom/sample_ct.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"

namespace {
using namespace coral::phantom;

SampleSpec small_spec()
{
    SampleSpec spec;
    spec.grains = 3;
    spec.voxel_size.setConstant(8e-3 / 20);
    return spec;
}

TEST(SampleCt, labels_hold_each_grain_with_its_true_volume)
{
    const Sample sample = make_sample(small_spec());
    std::map<std::uint32_t, double> volumes;
    for (const auto v : sample.labels.values) volumes[v] += sample.labels.voxel_size.prod();
    ASSERT_EQ(volumes.size(), 4u);
    for (std::uint32_t n = 1; n <= 3; ++n) EXPECT_NEAR(volumes[n] / sample.grains[n - 1].truth.volume, 1.0, 0.02);
    // The partial volumes add up to the very figure.
    const double solid =
        std::accumulate(sample.fraction.begin(), sample.fraction.end(), 0.0) * sample.labels.voxel_size.prod();
    double truth = 0;
    for (const auto& grain : sample.grains) truth += grain.truth.volume;
    EXPECT_NEAR(solid / truth, 1.0, 1e-6);
}

TEST(SampleCt, is_the_same_for_any_number_of_threads_and_differs_by_seed)
{
    coral::set_thread_count(1);
    const Sample one = make_sample(small_spec());
    const auto grey_one = grey_stack(one, {}, 4);
    coral::set_thread_count(2);
    const Sample two = make_sample(small_spec());
    EXPECT_EQ(one.labels.values, two.labels.values);
    EXPECT_EQ(truth_table(one).to_csv(), truth_table(two).to_csv());
    EXPECT_EQ(grey_one.values, grey_stack(two, {}, 4).values);
    SampleSpec other = small_spec();
    other.seed = 2;
    EXPECT_NE(truth_table(make_sample(other)).to_csv(), truth_table(one).to_csv());
}

TEST(SampleCt, grains_keep_apart_unless_asked_to_touch)
{
    SampleSpec spec = small_spec();
    spec.grains = 4;
    for (const bool touching : {false, true}) {
        spec.touching = touching;
        const Sample sample = make_sample(spec);
        const auto& s = sample.labels;
        int contacts = 0;
        for (int k = 0; k + 1 < s.size.z(); ++k) {
            for (int j = 0; j + 1 < s.size.y(); ++j) {
                for (int i = 0; i + 1 < s.size.x(); ++i) {
                    const auto here = s.values[s.index(i, j, k)];
                    for (const auto there : {s.index(i + 1, j, k), s.index(i, j + 1, k), s.index(i, j, k + 1)}) {
                        contacts += here != 0 && s.values[there] != 0 && s.values[there] != here;
                    }
                }
            }
        }
        EXPECT_EQ(contacts > 0, touching);
        // Nothing lies on the border.
        for (int k = 0; k < s.size.z(); ++k) {
            for (int j = 0; j < s.size.y(); ++j)
                EXPECT_EQ(s.values[s.index(0, j, k)] + s.values[s.index(s.size.x() - 1, j, k)], 0u);
        }
    }
}

TEST(SampleCt, grey_values_lie_between_the_two_phases_without_noise)
{
    const Sample sample = make_sample(small_spec());
    const auto grey = grey_stack(sample, {.noise = 0}, 1);
    double sum = 0;
    for (std::size_t n = 0; n < grey.values.size(); ++n) {
        ASSERT_GE(grey.values[n], 60u);
        ASSERT_LE(grey.values[n], 180u);
        sum += (grey.values[n] - 60.0) / 120;
    }
    const double solid = std::accumulate(sample.fraction.begin(), sample.fraction.end(), 0.0);
    EXPECT_NEAR(sum / solid, 1.0, 2e-3);
}

TEST(SampleCt, refuses_an_even_supersample)
{
    SampleSpec spec = small_spec();
    spec.supersample = 2;
    EXPECT_THROW(make_sample(spec), coral::UsageError);
}
}  // namespace
