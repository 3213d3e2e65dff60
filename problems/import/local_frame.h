// Geodetic positions (WGS 84) in a local frame.
#pragma once

#include <Eigen/Core>
#include <memory>

namespace GeographicLib {
class LocalCartesian;
}

namespace trueline {

// North, east and down (m) at the first position given: the plane tangential to the ellipsoid
// there, and not the curved surface, so that distances are right.
class LocalFrame {
 public:
  LocalFrame();
  ~LocalFrame();

  // Whether there is such a place (deg). Receivers without a fix report zeros.
  static bool IsPlace(double latitude, double longitude);
  // Degrees and m.
  Eigen::Vector3d ToNed(double latitude, double longitude, double height);

 private:
  std::unique_ptr<GeographicLib::LocalCartesian> frame_;  // null before the first position
};

}  // namespace trueline
