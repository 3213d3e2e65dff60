#include "problems/import/local_frame.h"

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <cmath>

#include "problems/common/units.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kNear = 1e4;  // m

// Of longitudes (deg), which may lie on both sides of the date line.
double MedianLongitude(const std::vector<Eigen::Vector3d>& positions) {
  double sine = 0.0, cosine = 0.0;
  for (const Eigen::Vector3d& position : positions) {
    sine += std::sin(kDegree * position.y());
    cosine += std::cos(kDegree * position.y());
  }
  const double mean = std::atan2(sine, cosine) / kDegree;
  std::vector<double> differences;
  for (const Eigen::Vector3d& position : positions) {
    differences.push_back(std::remainder(position.y() - mean, 360.0));
  }
  return mean + UpperMedian(differences);
}

double MedianLatitude(const std::vector<Eigen::Vector3d>& positions) {
  std::vector<double> latitudes;
  for (const Eigen::Vector3d& position : positions) latitudes.push_back(position.x());
  return UpperMedian(latitudes);
}

}  // namespace

LocalFrame::LocalFrame() = default;
LocalFrame::~LocalFrame() = default;

bool LocalFrame::IsPlace(double latitude, double longitude) {
  return std::abs(latitude) <= 90.0 && std::abs(longitude) <= 360.0 &&
         (latitude != 0.0 || longitude != 0.0);
}

// On a flight so long that its median lies far from its path, the first position.
void LocalFrame::SetOrigin() {
  median_ = std::make_unique<GeographicLib::LocalCartesian>(MedianLatitude(positions_),
                                                            MedianLongitude(positions_), 0.0);
  auto first = std::find_if(positions_.begin(), positions_.end(),
                            [&](const Eigen::Vector3d& p) { return IsNear(p); });
  if (first == positions_.end()) first = positions_.begin();
  frame_ = std::make_unique<GeographicLib::LocalCartesian>(first->x(), first->y(), first->z());
  positions_ = {};
}

bool LocalFrame::IsNear(const Eigen::Vector3d& position) {
  if (!median_) SetOrigin();
  Eigen::Vector3d away = Eigen::Vector3d::Zero();  // the chord's, without the height
  median_->Forward(position.x(), position.y(), 0.0, away.x(), away.y(), away.z());
  return away.norm() < kNear;
}

Eigen::Vector3d LocalFrame::ToNed(const Eigen::Vector3d& position) {
  if (!frame_) SetOrigin();
  double east = 0.0, north = 0.0, up = 0.0;
  frame_->Forward(position.x(), position.y(), position.z(), east, north, up);
  return {north, east, -up};
}

}  // namespace trueline
