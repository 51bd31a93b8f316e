#include "pack/criteria.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace coral::pack;

namespace {

/// The paper's gradation: 30 % fines, diameters even by number from 1.5 to 3 mm (mass below d grows with d^4), coarse of 15 mm.
Psd paper_gradation()
{
    Psd psd;
    const auto fourth = [](double d) { return d * d * d * d; };
    for (int i = 0; i <= 60; ++i) {
        const double d = 1.5e-3 * (1 + i / 60.0);
        psd.push_back({d, 0.3 * (fourth(d) - fourth(1.5e-3)) / (fourth(3e-3) - fourth(1.5e-3))});
    }
    psd.push_back({15e-3, 0.3});
    psd.push_back({15e-3, 1.0});
    return psd;
}

const Criterion& named(const std::vector<Criterion>& criteria, const std::string& name)
{
    for (const Criterion& c : criteria)
        if (c.name == name) return c;
    throw std::runtime_error("no criterion " + name);
}

}  // namespace

TEST(Gradation, steps_at_each_diameter_and_ends_at_one)
{
    const std::vector<double> d{2, 1, 2}, m{1, 2, 1};
    const Psd psd = gradation(d, m);
    EXPECT_DOUBLE_EQ(passing_at(psd, 0.99), 0);
    EXPECT_DOUBLE_EQ(passing_at(psd, 1), 0.5);
    EXPECT_DOUBLE_EQ(passing_at(psd, 1.99), 0.5);
    EXPECT_DOUBLE_EQ(passing_at(psd, 2), 1);
    EXPECT_DOUBLE_EQ(size_at(psd, 0.5), 1);
    EXPECT_DOUBLE_EQ(size_at(psd, 0.51), 2);
    EXPECT_DOUBLE_EQ(size_at(psd, 1), 2);
}

TEST(Gradation, is_linear_in_log_size_between_points)
{
    const Psd psd{{1, 0}, {4, 1}};
    EXPECT_NEAR(passing_at(psd, 2), 0.5, 1e-15);
    EXPECT_NEAR(size_at(psd, 0.25), std::sqrt(2.0), 1e-15);
    EXPECT_NEAR(uniformity(psd), 2, 1e-14);  // 4^(0.6 - 0.1)
}

TEST(Gradation, of_a_part_starts_on_the_far_side_of_a_gap)
{
    const Psd coarse = between(paper_gradation(), 0.3, 1), fine = between(paper_gradation(), 0, 0.3);
    EXPECT_DOUBLE_EQ(coarse.front().size, 15e-3);
    EXPECT_DOUBLE_EQ(size_at(coarse, 0.01), 15e-3);
    EXPECT_DOUBLE_EQ(size_at(fine, 1), 3e-3);
    EXPECT_DOUBLE_EQ(fine.front().size, 1.5e-3);
}

// Table 1 of Huang et al.: Kezdi 5.0, Kenney-Lau 0, Mao 0.54. The text gives no curve; with fines even by number d85f = 2.888 mm and
// D15c/d85f = 5.19; 5.0 is reached when d85f is read as the upper sieve of 3 mm. Mao's 0.54 implies n = 0.55.
TEST(StabilityCriteria, give_the_verdicts_of_the_paper_for_its_gradation)
{
    const auto criteria = stability_criteria(paper_gradation(), 0.3, 0.55);
    EXPECT_NEAR(named(criteria, "kezdi").value, 15 / 2.8879, 0.005);
    EXPECT_NEAR(named(criteria, "kezdi").value, 5.0, 0.05 * 5.0);
    EXPECT_NEAR(named(criteria, "kenney-lau").value, 0, 1e-12);
    EXPECT_NEAR(named(criteria, "mao").value, 0.54, 1e-12);
    for (const char* name : {"kezdi", "kenney-lau", "mao"}) EXPECT_EQ(named(criteria, name).verdict, "unstable") << name;
}

TEST(StabilityCriteria, give_kezdi_five_when_all_fines_are_of_three_millimetres)
{
    const Psd sieved{{3e-3, 0}, {3e-3, 0.3}, {15e-3, 0.3}, {15e-3, 1}};
    EXPECT_DOUBLE_EQ(kezdi_ratio(sieved, 0.3), 5.0);
    EXPECT_DOUBLE_EQ(kenney_lau_ratio(sieved, 0.3), 0.0);
}

// Straight line in log d over a factor 4^4: passing(4d) - passing(d) = 1/4 everywhere, so H/F = 0.25/F is least at the largest F.
TEST(StabilityCriteria, give_kenney_lau_in_closed_form_on_a_straight_gradation)
{
    const Psd psd{{1, 0}, {256, 1}};
    EXPECT_NEAR(kenney_lau_ratio(psd, 0.2), 1.25, 1e-12);
    EXPECT_NEAR(kenney_lau_ratio(psd, 0.3), 0.25 / 0.3, 1e-12);
    const auto criteria = stability_criteria(psd, 0, 0.4);
    EXPECT_EQ(named(criteria, "kenney-lau").verdict, "stable");          // 1.25 >= 1, wide gradation: F <= 0.2
    EXPECT_EQ(named(criteria, "kenney-lau-1985").verdict, "unstable");   // 1.25 < 1.3
    EXPECT_EQ(named(criteria, "kezdi").verdict, "not applicable");
    EXPECT_TRUE(std::isnan(named(criteria, "mao").value));
}

TEST(StabilityCriteria, find_the_least_kenney_lau_ratio_that_brute_force_finds)
{
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int trial = 0; trial < 20; ++trial) {
        Psd psd{{1, 0}};
        for (int i = 0; i < 5; ++i) psd.push_back({psd.back().size * (1 + 3 * uniform(random)), psd.back().passing + uniform(random)});
        for (PsdPoint& p : psd) p.passing /= psd.back().passing;
        psd.back().passing = 1;
        double least = 1e300;
        for (double d = 1.0001; passing_at(psd, d) <= 0.3; d *= 1.0001)
            least = std::min(least, passing_at(psd, 4 * d) / passing_at(psd, d) - 1);
        EXPECT_NEAR(kenney_lau_ratio(psd, 0.3), least, 2e-3 * (1 + least)) << trial;
    }
}

// h' = d90/d60 and h'' = d90/d15 straight from the points: k = 1/lg 10 = 1 inside the band, 2 above it, 0.5 below it.
TEST(StabilityCriteria, give_burenkova_as_the_distance_from_the_middle_of_its_band)
{
    const auto of = [](double d15, double d60, double d90) { return Psd{{0.5, 0}, {d15, 0.15}, {d60, 0.60}, {d90, 0.90}, {100, 1}}; };
    EXPECT_NEAR(burenkova_distance(of(1, 5, 10)), 0.31 / 0.55, 1e-12);
    EXPECT_NEAR(burenkova_distance(of(1, 10.0 / 3, 10)), 0.69 / 0.55, 1e-12);
    EXPECT_NEAR(burenkova_distance(of(1, 10 / 1.5, 10)), 0.81 / 0.55, 1e-12);
    EXPECT_NEAR(burenkova_distance(of(1, 10 / 1.76, 10)), 1, 1e-12);  // h' = 0.76 lg h'' + 1
    EXPECT_NEAR(burenkova_distance(of(1, 10 / 2.86, 10)), 1, 1e-12);  // h' = 1.86 lg h'' + 1
    EXPECT_EQ(named(stability_criteria(of(1, 5, 10), 0, 0.4), "burenkova").verdict, "stable");
    EXPECT_EQ(named(stability_criteria(of(1, 10.0 / 3, 10), 0, 0.4), "burenkova").verdict, "unstable");
    EXPECT_EQ(named(stability_criteria({{2, 0}, {2, 1}}, 0, 0.4), "burenkova").verdict, "not applicable");
    EXPECT_NEAR(burenkova_distance(paper_gradation()), 1.31 / 0.55, 1e-12);  // h' = 1: the coarse grains have one size
}

namespace {

/// A coarse sphere of 2 m between two walls along x, pressed with 30 N, and a fine one of 1 m on top of it (0, 0, 1.5), pressed down by a wall with 6 N.
Sample pressed_pair()
{
    Sample s;
    s.shapes = {unit_sphere()};
    s.materials = {{}};
    s.particles.resize(2);
    s.particles[0].scale = 2;
    s.particles[1].scale = 1;
    s.particles[1].role = Role::fine;
    s.particles[1].position = {0, 0, 1.5};
    const auto contact = [](int first, int second, const Eigen::Vector3d& point, const Eigen::Vector3d& force) {
        Contact c;
        c.first = first;
        c.second = second;
        c.point = point;
        c.normal_force = force;
        return c;
    };
    s.contacts = {contact(0, -1, {-1, 0, 0}, {30, 0, 0}), contact(0, -2, {1, 0, 0}, {-30, 0, 0}), contact(0, 1, {0, 0, 1}, {0, 0, -6}),
                  contact(1, -6, {0, 0, 2}, {0, 0, -6}), contact(0, -5, {0, 0, -1}, {0, 0, 6})};
    return s;
}

}  // namespace

// By hand: the fine grain has p V = (6 x 0.5 + 6 x 0.5)/3 = 2 J, the coarse one (30 + 30 + 6 + 6)/3 = 24 J; volumes are as 1 : 8, so
// alpha = (2/1) / (26/9) = 9/13.
TEST(StabilityCriteria, give_the_stress_of_the_fines_from_contact_forces)
{
    Sample s = pressed_pair();
    EXPECT_NEAR(fines_stress_ratio(s), 9.0 / 13, 1e-14);
    const Criterion c = named(stability_criteria(paper_gradation(), 0.3, 0.5, fines_stress_ratio(s)), "skempton-brogan");
    EXPECT_EQ(c.verdict, "stable");
    EXPECT_NE(c.definition.find("Skempton and Brogan 1994"), std::string::npos);
    for (int k : {2, 3}) s.contacts[std::size_t(k)].normal_force *= 0.5;  // p V of the fine one 1 J, of the coarse one 23 J: 9/24
    EXPECT_NEAR(fines_stress_ratio(s), 9.0 / 24, 1e-14);
    EXPECT_EQ(named(stability_criteria(paper_gradation(), 0.3, 0.5, fines_stress_ratio(s)), "skempton-brogan").verdict, "unstable");
}

TEST(StabilityCriteria, count_a_tangential_force_in_the_stress_only_as_far_as_it_presses)
{
    Sample s = pressed_pair();
    for (Contact& c : s.contacts) c.tangential_force = {0, 5, 0};  // at right angles to every branch vector
    EXPECT_NEAR(fines_stress_ratio(s), 9.0 / 13, 1e-14);
}

TEST(StabilityCriteria, have_no_stress_of_the_fines_without_contacts_or_without_fines)
{
    Sample s = pressed_pair();
    s.particles[1].role = Role::coarse;
    EXPECT_TRUE(std::isnan(fines_stress_ratio(s)));
    s = pressed_pair();
    s.contacts.clear();
    EXPECT_TRUE(std::isnan(fines_stress_ratio(s)));
    EXPECT_EQ(named(stability_criteria(paper_gradation(), 0.3, 0.5, fines_stress_ratio(s)), "skempton-brogan").verdict, "not applicable");
}

TEST(RelativeDensity, is_zero_at_the_loosest_and_one_at_the_densest_state)
{
    EXPECT_DOUBLE_EQ(relative_density(1.4, 0.8, 1.4), 0);
    EXPECT_DOUBLE_EQ(relative_density(0.8, 0.8, 1.4), 1);
    EXPECT_NEAR(relative_density(1.1, 0.8, 1.4), 0.5, 1e-15);
    EXPECT_NEAR(relative_density(0.95, 0.8, 1.4), 0.75, 1e-15);
}
