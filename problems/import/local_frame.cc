#include "problems/import/local_frame.h"

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>

namespace trueline {

LocalFrame::LocalFrame() = default;
LocalFrame::~LocalFrame() = default;

bool LocalFrame::IsPlace(double latitude, double longitude) {
  return std::abs(latitude) <= 90.0 && std::abs(longitude) <= 360.0 &&
         (latitude != 0.0 || longitude != 0.0);
}

Eigen::Vector3d LocalFrame::ToNed(double latitude, double longitude, double height) {
  if (!frame_) {
    frame_ = std::make_unique<GeographicLib::LocalCartesian>(latitude, longitude, height);
  }
  double east = 0.0, north = 0.0, up = 0.0;
  frame_->Forward(latitude, longitude, height, east, north, up);
  return {north, east, -up};
}

}  // namespace trueline
