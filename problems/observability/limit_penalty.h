// How far a spline flight breaks its limits, smoothly, with the gradient: the mean over a grid of
// times of the squared excess of every limit, each as a share of its range.
#pragma once

#include <vector>

#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/limits.h"

namespace trueline {

class LimitPenalty {
 public:
  // `margin`: share of each limit that is kept free, so that the limits also hold between the
  // points of the grid. The travel limit is half to either side of the start.
  LimitPenalty(FlatVehicle vehicle, SplineShape shape, FlightLimits limits, double step,
               double margin);

  // For the free control points, 4 x num_free; zero where all limits hold.
  double Evaluate(const FlatMatrix& free, FlatMatrix* gradient) const;

 private:
  FlatVehicle vehicle_;
  SplineShape shape_;
  FlightLimits limits_;
  int per_piece_;
  double margin_;
};

}  // namespace trueline
