// One linearised flight under many strengths of noise.
#pragma once

#include <vector>

#include "problems/chain/section_chain.h"
#include "problems/diagnosis/chain_stacks.h"

namespace trueline {

// Gives what ChainSystem::reduced does, as one cluster. What no strength changes is made once, and
// no factor is kept, so that a search over strengths is fast. For one thread.
class NoisyFlight {
 public:
  // What `linear` refers to must outlive this object.
  explicit NoisyFlight(const LinearFlight& linear);

  ReducedSystem Reduced(const NoiseStrengths& noise);

 private:
  using Chain = SectionChain<kNodeSize, 0>;
  using Rows = SegmentRows::Values;

  // Whitened with strengths of one, columns in the chain's order.
  struct Measurements {
    Rows rows;
    int count;           // of measurements; `rows` may hold fewer of the same squares
    double log_weights;  // of all
  };
  struct Segment {
    Measurements fixes, forces;
    SegmentRows link;  // not whitened
  };

  double AddLink(int segment, const NoiseStrengths& noise);

  LinearFlight linear_;
  std::vector<Segment> segments_;
  Chain chain_;
  Rows whitened_, ordered_;  // of a link
};

}  // namespace trueline
