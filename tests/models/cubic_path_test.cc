// The cubic through position and velocity at both ends of a step.
#include "cost_functions/models/cubic_path.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

namespace trueline {
namespace {

using Eigen::Vector3d;

TEST(CubicPath, ReproducesACubic) {
  const Vector3d c0(3, 4, 5), c1(1, -2, 0.5), c2(0.7, 2, -1), c3(-0.4, 0.3, 0.2);
  const auto place = [&](double t) -> Vector3d { return c0 + t * (c1 + t * (c2 + t * c3)); };
  const auto speed = [&](double t) -> Vector3d { return c1 + t * (2.0 * c2 + 3.0 * t * c3); };
  const double seconds = 1.7;
  const Vector3d p0 = place(0.0), v0 = speed(0.0), p1 = place(seconds), v1 = speed(seconds);
  for (const double u : {-0.2, 0.0, 0.3, 0.8, 1.0}) {
    const double t = u * seconds;
    EXPECT_LT((CubicPath(p0, v0, p1, v1, seconds, u) - place(t)).norm(), 1e-12) << u;
    EXPECT_LT((CubicPathVelocity(p0, v0, p1, v1, seconds, u) - speed(t)).norm(), 1e-12) << u;
  }
}

}  // namespace
}  // namespace trueline
