// Asks after a calibration whether its flight shows a wind that the model lacks. Constants then
// contain the wind: a bias at one heading, drag and misalignments on a course. Arcs end inside of
// their ellipses as before, so nothing in the calibration itself tells.
//
// The diagnosis' base fit tests this effect alone: first its score, then, where that is
// significant, the fit with the wind. Noise that was learned without a wind absorbs most of it (one
// linear step gives 1.0 of 4.2 m/s on a simulated hippodrome), so the score tells that there is a
// wind and not its size. The calibration is then repeated with the wind, and its constants are
// compared.
//
// A calm flight costs one base fit. Of a flight longer than ten minutes only the last four before
// the end of the reported window are fitted, estimated at less than 30 % of the calibration's time.
// A flight with a wind also costs a fit with it and the reported run once more.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "problems/calibration/calibration.h"

namespace trueline {

// A stated constant without and with an effect in the model.
struct MovedConstant {
  std::string name, unit;
  double without, with;
  double sigmas;  // of the move, in those that the calibration states
};

struct UnmodelledWind {
  Eigen::Vector2d value, sigma;      // m/s, in E
  double p;                          // of the one test
  std::vector<MovedConstant> moved;  // all stated constants, the one that moves most first
};

// None if the flight shows no wind, indoors, where the model has a wind already, or where the base
// fit can't be made (too few passes). `options`: those that `calibration` was made with. Where the
// reported estimator takes no wind, the constants' moves are those in the base fit.
std::optional<UnmodelledWind> FindUnmodelledWind(const FlightLog& log,
                                                 const CalibrationOptions& options,
                                                 const Calibration& calibration);

// States such a wind: with a constant that moves by more than two of its sigmas the verdict is
// `poor` at best, otherwise it is a warning. Of several flights the first, `log`, is asked.
void JudgeWind(const FlightLog& log, const CalibrationOptions& options, Calibration* calibration);

}  // namespace trueline
