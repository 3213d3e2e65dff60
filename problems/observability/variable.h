// Reverse-mode differentiation on a tape, for functions of many numbers built from few kinds of
// operations: the design's score depends on hundreds of control points. Numbers that depend on no
// variable carry no tape entry, and products with zero vanish, so that sparse Jets stay sparse.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

namespace trueline {

class Variable;

// One function evaluation's operations. Each thread records on its own tape.
class Tape {
 public:
  static Tape& OfThread() {
    thread_local Tape tape;
    return tape;
  }
  void Clear() { nodes_.clear(); }
  std::int32_t Record(std::int32_t a, double da, std::int32_t b = -1, double db = 0.0) {
    nodes_.push_back({a, b, da, db});
    return static_cast<std::int32_t>(nodes_.size()) - 1;
  }
  // Adjoints of all entries from those given (by entry); `adjoints` is resized by StartAdjoints.
  void StartAdjoints(std::vector<double>* adjoints) const { adjoints->assign(nodes_.size(), 0.0); }
  void Sweep(std::vector<double>* adjoints) const {
    for (std::size_t i = nodes_.size(); i-- > 0;) {
      const double adjoint = (*adjoints)[i];
      if (adjoint == 0.0) continue;
      if (nodes_[i].a >= 0) (*adjoints)[nodes_[i].a] += adjoint * nodes_[i].da;
      if (nodes_[i].b >= 0) (*adjoints)[nodes_[i].b] += adjoint * nodes_[i].db;
    }
  }

 private:
  struct Node {
    std::int32_t a, b;  // operands, -1 for none
    double da, db;      // derivatives by them
  };
  std::vector<Node> nodes_;
};

class Variable {
 public:
  constexpr Variable() = default;
  constexpr explicit Variable(double constant) : value_(constant) {}
  // A new independent variable on this thread's tape.
  static Variable Independent(double value) { return {value, Tape::OfThread().Record(-1, 0.0)}; }

  double value() const { return value_; }
  std::int32_t entry() const { return entry_; }  // -1 for constants

  friend Variable operator+(const Variable& a, const Variable& b) {
    if (b.IsZero()) return a;
    if (a.IsZero()) return b;
    return Make(a.value_ + b.value_, a.entry_, 1.0, b.entry_, 1.0);
  }
  friend Variable operator-(const Variable& a, const Variable& b) {
    if (b.IsZero()) return a;
    return Make(a.value_ - b.value_, a.entry_, 1.0, b.entry_, -1.0);
  }
  friend Variable operator-(const Variable& a) { return Make(-a.value_, a.entry_, -1.0); }
  friend Variable operator*(const Variable& a, const Variable& b) {
    if (a.IsZero() || b.IsZero()) return Variable();
    if (a.IsOne()) return b;
    if (b.IsOne()) return a;
    return Make(a.value_ * b.value_, a.entry_, b.value_, b.entry_, a.value_);
  }
  friend Variable operator/(const Variable& a, const Variable& b) {
    if (a.IsZero()) return Variable();
    const double quotient = a.value_ / b.value_;
    return Make(quotient, a.entry_, 1.0 / b.value_, b.entry_, -quotient / b.value_);
  }
  Variable& operator+=(const Variable& b) { return *this = *this + b; }
  Variable& operator-=(const Variable& b) { return *this = *this - b; }
  Variable& operator*=(const Variable& b) { return *this = *this * b; }
  Variable& operator/=(const Variable& b) { return *this = *this / b; }
  friend Variable sqrt(const Variable& a) {
    const double root = std::sqrt(a.value_);
    return Make(root, a.entry_, 0.5 / root);
  }
  friend Variable sin(const Variable& a) {
    return Make(std::sin(a.value_), a.entry_, std::cos(a.value_));
  }
  friend Variable cos(const Variable& a) {
    return Make(std::cos(a.value_), a.entry_, -std::sin(a.value_));
  }

 private:
  Variable(double value, std::int32_t entry) : value_(value), entry_(entry) {}
  static Variable Make(double value, std::int32_t a, double da, std::int32_t b = -1,
                       double db = 0.0) {
    if (a < 0 && b < 0) return Variable(value);
    return {value, Tape::OfThread().Record(a, da, b, db)};
  }
  bool IsZero() const { return entry_ < 0 && value_ == 0.0; }
  bool IsOne() const { return entry_ < 0 && value_ == 1.0; }

  double value_ = 0.0;
  std::int32_t entry_ = -1;
};

}  // namespace trueline

namespace Eigen {
template <>
struct NumTraits<trueline::Variable> : GenericNumTraits<double> {
  using Real = trueline::Variable;
  using NonInteger = trueline::Variable;
  using Nested = trueline::Variable;
  using Literal = trueline::Variable;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 10,
    MulCost = 10
  };
};
}  // namespace Eigen
