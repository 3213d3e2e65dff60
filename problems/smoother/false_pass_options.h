// What the smoother believes of false passes.
#pragma once

namespace trueline {

// Model of a false pass: another object was detected as the gate.
struct FalsePassOptions {
  double probability = 0.05;  // prior probability that a pass is false; 0: never
  double offset = 2.0;        // m, sigma of its fixes' common error, each axis
  double offset_rate = 0.2;   // m/s, sigma of that error's change: what is seen may be nearer
  // Prior probability that the past is wrong: the path starts anew, parameters are kept.
  double lost_probability = 0.001;
};

}  // namespace trueline
