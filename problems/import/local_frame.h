// Geodetic positions (WGS 84) in a local frame.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace GeographicLib {
class LocalCartesian;
}

namespace trueline {

// North, east and down (m) at the first position that lies near the median of all: the plane
// tangential to the ellipsoid there, and not the curved surface, so that distances are right. A
// receiver's first fix may be thousands of km off.
class LocalFrame {
 public:
  LocalFrame();
  ~LocalFrame();

  // Whether there is such a place (deg). Receivers without a fix report zeros.
  static bool IsPlace(double latitude, double longitude);

  // Latitude and longitude (deg) and height (m) of each position, in the file's order, before the
  // first call of the functions below.
  void Add(const Eigen::Vector3d& position) { positions_.push_back(position); }

  Eigen::Vector3d ToNed(const Eigen::Vector3d& position);
  // Within 10 km of the median.
  bool IsNear(const Eigen::Vector3d& position);

 private:
  void SetOrigin();

  std::vector<Eigen::Vector3d> positions_;
  std::unique_ptr<GeographicLib::LocalCartesian> frame_;   // null before the origin is set
  std::unique_ptr<GeographicLib::LocalCartesian> median_;  // likewise; at height zero
};

}  // namespace trueline
