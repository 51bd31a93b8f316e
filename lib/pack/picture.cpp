#include "pack/picture.h"

#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "core/error.h"
#include "core/output_file.h"
#include "core/parallel.h"
#include "dem/shape.h"
#include "pack/sample_world.h"

namespace coral::pack {
namespace {

using Vec3 = Eigen::Vector3d;

constexpr int tile = 16;               ///< pixels of an edge
constexpr double margin = 0.02;        ///< of the picture, on every side
constexpr int most_steps = 400;
constexpr double never = std::numeric_limits<double>::infinity();

const Vec3 towards = Vec3(-0.34, 1, -0.42).normalized();  ///< the way of every ray
const Vec3 light = Vec3(-0.45, -0.65, 1.0).normalized();

struct Body {
    const dem::Shape* shape;
    Vec3 centre;
    Eigen::Quaterniond turned_back;
    double scale, bound;
    Vec3 colour;
    bool coarse;
    double u, v, depth;  ///< of the centre on the picture plane and along the rays [m]
};

struct Hit {
    double along = never;
    Vec3 colour = Vec3::Ones();
};

/// Violet to yellow by way of green (five stations of the viridis map).
Vec3 scale_colour(double share)
{
    static const std::array<Vec3, 5> stations{Vec3(0.267, 0.005, 0.329), Vec3(0.229, 0.322, 0.546), Vec3(0.128, 0.567, 0.551), Vec3(0.369, 0.789, 0.383), Vec3(0.993, 0.906, 0.144)};
    const double at = std::clamp(share, 0.0, 1.0) * 4;
    const std::size_t k = std::min<std::size_t>(3, std::size_t(at));
    return stations[k] + (at - double(k)) * (stations[k + 1] - stations[k]);
}

Vec3 shaded(const Vec3& colour, const Vec3& normal)
{
    const double head = std::max(0.0, -normal.dot(towards)), key = std::max(0.0, normal.dot(light));
    return (0.18 + 0.37 * head + 0.45 * key) * colour;
}

class Scene {
public:
    Scene(const Sample& sample, int pixels) : cut_(0.5 * sample.size.y())
    {
        right_ = towards.cross(Vec3::UnitZ()).normalized();
        up_ = right_.cross(towards);
        for (const ShapeTemplate& shape : sample.shapes) shapes_.push_back(make_shape(shape));
        add_bodies(sample);
        frame(sample, pixels);
        sort_into_tiles();
    }

    Picture draw() const
    {
        Picture picture{width_, height_, std::vector<std::uint8_t>(std::size_t(width_) * std::size_t(height_) * 3)};
        parallel_blocks(tiles_.size(), 1, [&](std::size_t t, std::size_t) {
            const int x0 = int(t) % tiles_across_ * tile, y0 = int(t) / tiles_across_ * tile;
            for (int y = y0; y < std::min(y0 + tile, height_); ++y)
                for (int x = x0; x < std::min(x0 + tile, width_); ++x) {
                    Vec3 colour = Vec3::Zero();  // four rays a pixel
                    for (int k = 0; k < 4; ++k) colour += 0.25 * ray(x + 0.25 + 0.5 * (k % 2), y + 0.25 + 0.5 * (k / 2), tiles_[t]);
                    for (int c = 0; c < 3; ++c)
                        picture.rgb[3 * (std::size_t(y) * std::size_t(width_) + std::size_t(x)) + std::size_t(c)] =
                            std::uint8_t(std::lround(255 * std::pow(std::clamp(colour[c], 0.0, 1.0), 1 / 1.3)));
                }
        });
        return picture;
    }

private:
    /// Places in which a ball shows in the box: across a periodic side it reaches in again from the other.
    static std::vector<Vec3> images(const Sample& sample, const Vec3& centre, double bound)
    {
        std::vector<Vec3> places{centre};
        for (int axis = 0; axis < 3; ++axis) {
            const double length = sample.period[axis];
            if (length <= 0) continue;
            for (std::size_t k = places.size(); k-- > 0;) {
                Vec3 image = places[k];
                image[axis] += image[axis] < 0.5 * length ? length : -length;
                if (image[axis] > -bound && image[axis] < length + bound) places.push_back(image);
            }
        }
        return places;
    }

    void add_bodies(const Sample& sample)
    {
        double smallest = never, largest = 0;
        for (const Particle& p : sample.particles) {
            if (p.role != Role::fine) continue;
            smallest = std::min(smallest, equivalent_diameter(sample, p));
            largest = std::max(largest, equivalent_diameter(sample, p));
        }
        for (std::size_t i = 0; i < sample.particles.size(); ++i) {
            const Particle& p = sample.particles[i];
            Body b;
            b.shape = shapes_[std::size_t(p.shape)].get();
            b.turned_back = p.orientation.conjugate();
            b.scale = p.scale;
            b.bound = p.scale * b.shape->bounding_radius();
            b.coarse = p.role == Role::coarse;
            const double tone = 0.03 * double(i % 5);  // neighbours differ a little
            b.colour = b.coarse ? Vec3(0.80 - tone, 0.66 - tone, 0.46 - tone)
                                : scale_colour(largest > smallest ? (equivalent_diameter(sample, p) - smallest) / (largest - smallest) : 0.5);
            for (const Vec3& centre : images(sample, p.position, b.bound)) {
                b.centre = centre;
                if (b.coarse ? b.centre.y() + b.bound < cut_ : b.centre.y() < cut_) continue;
                b.u = right_.dot(b.centre), b.v = up_.dot(b.centre), b.depth = towards.dot(b.centre);
                bodies_.push_back(b);
            }
        }
        std::stable_sort(bodies_.begin(), bodies_.end(), [](const Body& a, const Body& b) { return a.depth - a.bound < b.depth - b.bound; });
    }

    void frame(const Sample& sample, int pixels)
    {
        Eigen::Vector2d low(never, never), high(-never, -never);
        const auto take = [&](double u, double v, double r) {
            low = low.cwiseMin(Eigen::Vector2d(u - r, v - r)), high = high.cwiseMax(Eigen::Vector2d(u + r, v + r));
        };
        for (int k = 0; k < 8; ++k) {
            const Vec3 corner(k & 1 ? sample.size.x() : 0, k & 2 ? sample.size.y() : cut_, k & 4 ? sample.size.z() : 0);
            take(right_.dot(corner), up_.dot(corner), 0);
        }
        for (const Body& b : bodies_)
            if (!b.coarse || !sample.period.isZero(0)) take(b.u, b.v, b.bound);  // coarse grains stay within walls
        const Eigen::Vector2d size = (1 + 2 * margin) * (high - low);
        pixel_ = size.maxCoeff() / pixels;
        width_ = std::max(1, int(std::ceil(size.x() / pixel_))), height_ = std::max(1, int(std::ceil(size.y() / pixel_)));
        left_ = low.x() - margin * (high - low).x(), top_ = high.y() + margin * (high - low).y();
    }

    /// Bodies that each tile may see, nearest first.
    void sort_into_tiles()
    {
        tiles_across_ = (width_ + tile - 1) / tile;
        const int down = (height_ + tile - 1) / tile;
        tiles_.resize(std::size_t(tiles_across_) * std::size_t(down));
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            const Body& b = bodies_[i];
            const auto column = [&](double u) { return std::clamp(int(std::floor((u - left_) / pixel_)) / tile, 0, tiles_across_ - 1); };
            const auto row = [&](double v) { return std::clamp(int(std::floor((top_ - v) / pixel_)) / tile, 0, down - 1); };
            for (int r = row(b.v + b.bound); r <= row(b.v - b.bound); ++r)
                for (int c = column(b.u - b.bound); c <= column(b.u + b.bound); ++c) tiles_[std::size_t(r * tiles_across_ + c)].push_back(i);
        }
    }

    Vec3 ray(double x, double y, const std::vector<std::size_t>& candidates) const
    {
        const Vec3 on_plane = (left_ + x * pixel_) * right_ + (top_ - y * pixel_) * up_;
        Hit hit;
        for (const std::size_t i : candidates) {
            const Body& b = bodies_[i];
            if (b.depth - b.bound > hit.along) break;
            trace(b, on_plane, hit);
        }
        return hit.colour;
    }

    /// Points of the ray are on_plane + along towards. Takes the hit when it is nearer than what there is.
    void trace(const Body& b, const Vec3& on_plane, Hit& hit) const
    {
        const double middle = b.depth, aside = (on_plane + middle * towards - b.centre).squaredNorm(), inside = b.bound * b.bound - aside;
        if (inside <= 0) return;
        double along = middle - std::sqrt(inside);
        const double end = middle + std::sqrt(inside);
        const double at_cut = (cut_ - on_plane.y()) / towards.y();
        const bool cuts = b.coarse && along < at_cut;
        if (cuts) along = at_cut;
        if (b.shape->kind() == dem::ShapeKind::sphere && !cuts) {
            if (along < hit.along) hit = {along, shaded(b.colour, (on_plane + along * towards - b.centre).normalized())};
            return;
        }
        const double close = 0.02 * pixel_;
        Vec3 gradient = Vec3::Zero();
        for (int step = 0; step < most_steps && along < std::min(end, hit.along); ++step) {
            const Vec3 local = b.turned_back * (on_plane + along * towards - b.centre) / b.scale;
            const double distance = b.scale * b.shape->distance_and_gradient(local, gradient);
            if (distance < close) {
                const bool cap = cuts && step == 0;
                const Vec3 normal = cap ? Vec3(-Vec3::UnitY()) : Vec3((b.turned_back.conjugate() * gradient).normalized());
                hit = {along, cap ? Vec3(0.96, 0.90, 0.78) : shaded(b.colour, normal)};
                return;
            }
            along += std::max(0.9 * distance, close);
        }
    }

    double cut_;
    Vec3 right_, up_;
    std::vector<std::shared_ptr<const dem::Shape>> shapes_;
    std::vector<Body> bodies_;
    double pixel_ = 0, left_ = 0, top_ = 0;
    int width_ = 0, height_ = 0, tiles_across_ = 0;
    std::vector<std::vector<std::size_t>> tiles_;
};

}  // namespace

void check_png(const std::filesystem::path& file)
{
    if (file.extension() != ".png") throw UsageError("--figure " + file.string(), "is no kind of picture that is drawn", "end it in .png");
    if (!std::filesystem::is_directory(file.has_parent_path() ? file.parent_path() : ".")) throw UsageError("--figure " + file.string(), "its folder does not exist", "make the folder first");
}

void write_png(const Picture& picture, const std::filesystem::path& file)
{
    OutputFile output(file);
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = png_uint_32(picture.width);
    image.height = png_uint_32(picture.height);
    image.format = PNG_FORMAT_RGB;
    if (!png_image_write_to_file(&image, output.temporary().c_str(), 0, picture.rgb.data(), 0, nullptr))
        throw Error(file.string(), std::string("could not be written: ") + image.message, "check the space left on the disk");
    output.commit();
}

Picture draw_sample(const Sample& sample, int pixels) { return Scene(sample, std::max(pixels, 16)).draw(); }

}  // namespace coral::pack
