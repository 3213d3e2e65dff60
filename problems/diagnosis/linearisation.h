// A fitted flight linearised at its solution, with a column for each parameter of effects and of
// terms that the model may lack. The flight's states are eliminated.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "problems/chain/reduced_system.h"
#include "problems/effects/declaration.h"

namespace trueline {

// Columns of an effect. `unit` is the size of its parameters that one unit of a column stands for.
struct EffectColumns {
  std::vector<int> columns;
  Eigen::VectorXd unit;
  // Of a cause in the model that is an error of the accelerometer: its columns, had they been read
  // before the flight made them. A controller that answers what the model lacks makes them so.
  std::vector<int> answers = {};

  // Estimates from a neutral value, in columns' units, as parameters; and the inverse.
  Eigen::VectorXd Sizes(const EffectInfo& info, const Eigen::VectorXd& steps) const;
  Eigen::VectorXd Steps(const EffectInfo& info, const Eigen::VectorXd& sizes) const;
};

// A term that is no effect: a product of velocity, rates, thrust, place or time that acts as a
// force, as a moment or as an error of a reading. Terms describe a residual; they are never a
// cause.
struct TermColumns {
  std::string name;  // the variable that the residual is correlated with
  std::vector<int> columns;
  Eigen::VectorXd ordinary;  // sizes that are not reported, by column
  // Effects are sought beside it: an error of a reading, or what all vehicles have.
  bool held = false;
};

// What stands in which columns of a linearised fit: first the model's constants.
struct ColumnPlaces {
  std::vector<int> nuisances;         // constants and ordinary errors
  std::vector<std::string> ordinary;  // ids of the ordinary errors, which every vehicle has
  std::vector<EffectColumns> found;   // causes in the model, linearised at their values
  std::vector<EffectColumns> candidates;
  std::vector<TermColumns> terms;
  int placed = 0;

  // The next `count` columns.
  std::vector<int> Next(std::size_t count);
};

class Linearisation : public ReducedSystem, public ColumnPlaces {
 public:
  explicit Linearisation(ReducedSystem system, ColumnPlaces places = {})
      : ReducedSystem(std::move(system)), ColumnPlaces(std::move(places)) {}
  virtual ~Linearisation() = default;

  // A fit with noise learned again while one effect or term is in the model. Noise that was learned
  // without it contains what it explains.
  struct Relearned {
    double gain;                         // twice the increase of the log evidence
    std::unique_ptr<Linearisation> fit;  // its only candidate has these columns
  };
  // For each set of columns; empty if the drive's noise is not learned in this way.
  virtual std::vector<Relearned> Relearn(const std::vector<std::vector<int>>&) const { return {}; }

  // Nuisances, and the columns of all causes in the model.
  std::vector<int> Modelled() const;
  // The same without those of cause `which`.
  std::vector<int> Beside(std::size_t which) const;
};

template <class Item>
std::vector<Item> Concatenated(std::vector<Item> first, const std::vector<Item>& more) {
  first.insert(first.end(), more.begin(), more.end());
  return first;
}

}  // namespace trueline
