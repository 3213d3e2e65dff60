// A course of gates: corners rounded by arcs (lines and arcs), or way points joined by a spline.
#pragma once

#include <vector>

#include "problems/log/flight_log.h"
#include "problems/simulation/config.h"
#include "problems/simulation/path.h"

namespace trueline::simulation {

struct Course {
  Path path;
  std::vector<Gate> gates;  // the map; yaw is the flight direction
};

// Empty if the course can be flown, else what is wrong with it and how to correct it.
std::string CheckCourse(const CourseConfig& config);

// Throws InputError with CheckCourse's text.
Course BuildCourse(const CourseConfig& config);

}  // namespace trueline::simulation
