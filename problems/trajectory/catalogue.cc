#include "problems/trajectory/catalogue.h"

#include <glog/logging.h>

#include <cmath>

namespace trueline {

SplineShape SplineShape::Lasting(double duration) {
  return {duration, std::max(10, static_cast<int>(std::lround(2.0 * duration)))};
}

FlatMatrix RestToRest(const SplineShape& shape, const FlatMatrix& free) {
  CHECK_EQ(free.cols(), shape.num_free());
  FlatMatrix control = FlatMatrix::Zero(kFlatOutputs, shape.num_control());
  control.middleCols(shape.degree, shape.num_free()) = free;
  return control;
}

FlatMatrix RandomControl(const SplineShape& shape, double size, double yaw_size, Random* random) {
  FlatMatrix free(kFlatOutputs, shape.num_free());
  for (Eigen::Index j = 0; j < free.cols(); ++j) {
    for (int i = 0; i < kFlatOutputs; ++i) {
      free(i, j) = (i < 3 ? size : yaw_size) * random->Normal();
    }
  }
  return free;
}

Lissajous RandomFigure(double size, double yaw_size, Random* random) {
  Lissajous figure;
  for (int i = 0; i < kFlatOutputs; ++i) {
    figure.amplitude[i] = random->Uniform(0.2, 1.0) * (i < 3 ? size : yaw_size);
    figure.frequency[i] = random->Uniform(0.1, 1.5);
    figure.phase[i] = random->Uniform(0.0, 2.0 * M_PI);
  }
  return figure;
}

PiecewisePolynomial LissajousPath(const Lissajous& figure, double duration) {
  const auto expand = [&figure](double t) {
    FlatMatrix c(kFlatOutputs, kMatchedDerivatives + 1);
    for (int i = 0; i < kFlatOutputs; ++i) {
      const double w = 2.0 * M_PI * figure.frequency[i];
      double scale = figure.amplitude[i];  // times w^j / j!
      for (int j = 0; j <= kMatchedDerivatives; ++j) {
        c(i, j) = scale * std::sin(w * t + figure.phase[i] + 0.5 * M_PI * j);
        scale *= w / (j + 1);
      }
    }
    return c;
  };
  const double fastest = std::max(0.25, figure.frequency.maxCoeff());
  const int pieces = static_cast<int>(std::ceil(8.0 * fastest * duration));
  return PiecewisePolynomial::FromExpansions(expand, duration, pieces);
}

std::vector<Manoeuvre> PlainManoeuvres() {
  const auto figure = [](const Eigen::Vector4d& amplitude, const Eigen::Vector4d& frequency) {
    return Lissajous{amplitude, frequency, Eigen::Vector4d(0.0, M_PI / 2, M_PI / 3, 0.0)};
  };
  return {
      {"hover", figure({0, 0, 0, 0}, {0, 0, 0, 0})},
      {"up and down", figure({0, 0, 0.25, 0}, {0, 0, 0.6, 0})},
      {"turning left and right on the spot", figure({0, 0, 0, 1.0}, {0, 0, 0, 0.6})},
      {"forward and back", figure({0.45, 0, 0, 0}, {0.7, 0, 0, 0})},
      {"left and right", figure({0, 0.45, 0, 0}, {0, 0.7, 0, 0})},
      {"a circle without turning", figure({0.45, 0.45, 0, 0}, {0.6, 0.6, 0, 0})},
      {"a Lissajous figure with turns and climbs",
       figure({0.4, 0.4, 0.15, 1.0}, {0.5, 0.6, 0.7, 0.4})},
  };
}

}  // namespace trueline
