#pragma once
/// \file fluid/flow_field.h
/// Fields that the flow advances, in double or in single precision. Single halves what a step moves through memory; it keeps seven
/// digits of each value, sums are taken in double all the same. What is derived from bodies (solid fractions, weights) is always double.
#include <algorithm>
#include <span>
#include <variant>

#include "fluid/grid.h"

namespace coral::fluid {

enum class Precision {
    float64,  ///< the default
    float32,  ///< half the memory; volume and momentum close to about 1e-6, not to 1e-12
};

/// Calls body(Real{}), Real being the type of numbers of a precision.
template <class Body>
decltype(auto) in_precision(Precision precision, const Body& body)
{
    return precision == Precision::float32 ? body(float{}) : body(double{});
}

/// Padded array of either precision.
class FlowField {
public:
    FlowField() = default;
    FlowField(std::size_t size, Precision precision, double value = 0.0)
    {
        if (precision == Precision::float32)
            values_.emplace<Array<float>>(size, static_cast<float>(value));
        else
            values_.emplace<Array<double>>(size, value);
    }
    template <class Real>
    explicit FlowField(std::span<const Real> values) : values_(Array<Real>(values.begin(), values.end()))
    {
    }

    Precision precision() const { return values_.index() == 1 ? Precision::float32 : Precision::float64; }
    std::size_t size() const
    {
        return std::visit([](const auto& values) { return values.size(); }, values_);
    }
    bool empty() const { return size() == 0; }
    /// The values, of the type that the field has. \throws std::bad_variant_access  for the other type
    template <class Real>
    Real* data()
    {
        return std::get<Array<Real>>(values_).data();
    }
    template <class Real>
    const Real* data() const
    {
        return std::get<Array<Real>>(values_).data();
    }
    /// One value. Loops over many take data().
    double operator[](std::size_t at) const
    {
        return values_.index() == 1 ? double(std::get<1>(values_)[at]) : std::get<0>(values_)[at];
    }
    void set(std::size_t at, double value)
    {
        std::visit([&](auto& values) { values[at] = static_cast<typename std::decay_t<decltype(values)>::value_type>(value); }, values_);
    }
    void fill(double value)
    {
        std::visit([&](auto& values) { std::fill(values.begin(), values.end(), typename std::decay_t<decltype(values)>::value_type(value)); }, values_);
    }
    void swap(FlowField& other) { values_.swap(other.values_); }
    bool operator==(const FlowField&) const = default;

    /// The same values, rounded if need be.
    FlowField in(Precision precision) const
    {
        return in_precision(precision, [&]<class Real>(Real) {
            return std::visit([](const auto& from) { return FlowField(Array<Real>(from.begin(), from.end())); }, values_);
        });
    }

private:
    template <class Real>
    using Array = std::vector<Real, CacheAligned<Real>>;
    template <class Real>
    explicit FlowField(Array<Real>&& values) : values_(std::move(values))
    {
    }
    std::variant<Array<double>, Array<float>> values_;
};

}  // namespace coral::fluid
