#include "problems/diagnosis/misfit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "problems/result/statistics.h"

namespace trueline {
namespace {

std::vector<MisfitGrowth> GrowthOf(const std::vector<MisfitRow>& rows) {
  std::map<double, MisfitGrowth> by_horizon;
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  for (const auto& [before, after, at] : rows) {
    const MisfitGrowth none{before.horizon, 0, zero, zero, zero, zero};
    MisfitGrowth& g = by_horizon.try_emplace(before.horizon, none).first->second;
    ++g.replays;
    g.before_E += before.error_E.cwiseAbs2();
    g.after_E += after.error_E.cwiseAbs2();
    g.before_B += before.error_B.cwiseAbs2();
    g.after_B += after.error_B.cwiseAbs2();
  }
  std::vector<MisfitGrowth> growth;
  for (auto& [horizon, g] : by_horizon) {
    for (Eigen::Vector3d* square : {&g.before_E, &g.after_E, &g.before_B, &g.after_B}) {
      *square = (*square / g.replays).cwiseSqrt();
    }
    growth.push_back(g);
  }
  return growth;
}

struct Quantity {
  std::string name;
  std::function<double(const ReplaySituation&)> value;
  int bins;  // 0: categories as they are
};

const std::vector<Quantity>& Quantities() {
  using S = const ReplaySituation&;
  static const std::vector<Quantity> quantities = {
      {"speed", [](S s) { return s.speed; }, 5},
      {"acceleration", [](S s) { return s.acceleration; }, 5},
      {"thrust", [](S s) { return s.thrust; }, 5},
      {"turn rate", [](S s) { return s.rate; }, 5},
      {"heading", [](S s) { return std::floor(4.0 * s.heading / M_PI); }, 0},
      {"gate", [](S s) { return static_cast<double>(s.gate); }, 0},
      {"distance to the gate", [](S s) { return s.gate_distance; }, 4},
      {"height", [](S s) { return s.height; }, 4},
      {"time", [](S s) { return s.time; }, 5},
      {"battery", [](S s) { return s.battery; }, 4}};
  return quantities;
}

// Whole numbers (gates) as they are, -1 where there is none.
std::vector<int> Classes(const std::vector<double>& values) {
  std::vector<int> classes;
  classes.reserve(values.size());
  for (const double v : values) classes.push_back(std::isfinite(v) ? static_cast<int>(v) : -1);
  return classes;
}

MisfitShare ShareOf(const std::string& name, const std::vector<int>& bin,
                    const std::vector<Eigen::Vector2d>& body,
                    const std::vector<Eigen::Vector2d>& earth) {
  const VarianceShare in_body = VarianceShareOf(body, bin), in_earth = VarianceShareOf(earth, bin);
  return {name, in_body.share, in_earth.share,
          in_body.share > in_earth.share ? in_body.p : in_earth.p};
}

// From replays that do not overlap.
std::vector<MisfitShare> SharesOf(const std::vector<MisfitRow>& rows, double horizon) {
  std::vector<const MisfitRow*> chosen;
  std::vector<Eigen::Vector2d> body, earth;
  TimeNs last = std::numeric_limits<TimeNs>::min();
  for (const MisfitRow& row : rows) {
    const TimeNs start = row.before.end - FromSeconds(row.before.horizon);
    if (row.before.horizon != horizon || start < last) continue;
    last = row.before.end - 1;
    chosen.push_back(&row);
    body.emplace_back(row.before.error_B.head<2>());
    earth.emplace_back(row.before.error_E.head<2>());
  }
  std::vector<MisfitShare> shares;
  std::vector<double> north, east;
  for (const MisfitRow* row : chosen) {
    north.push_back(row->at.north);
    east.push_back(row->at.east);
  }
  std::vector<int> place = QuantileBins(north, 3);
  const std::vector<int> across = QuantileBins(east, 3);
  for (std::size_t i = 0; i < place.size(); ++i) place[i] = 3 * place[i] + across[i];
  shares.push_back(ShareOf("place on the course", place, body, earth));
  for (const Quantity& quantity : Quantities()) {
    std::vector<double> values;
    values.reserve(chosen.size());
    for (const MisfitRow* row : chosen) values.push_back(quantity.value(row->at));
    if (std::ranges::none_of(values, [](double v) { return std::isfinite(v); })) continue;
    const std::vector<int> bin =
        quantity.bins > 0 ? QuantileBins(values, quantity.bins) : Classes(values);
    shares.push_back(ShareOf(quantity.name, bin, body, earth));
  }
  std::ranges::stable_sort(shares, std::greater<>(), [](const MisfitShare& share) {
    return std::max(share.body, share.earth);
  });
  return shares;
}

}  // namespace

double LastBefore(const std::vector<ScalarSample>& samples, TimeNs t) {
  const auto after = std::ranges::upper_bound(samples, t, {}, &ScalarSample::t);
  return after == samples.begin() ? NAN : std::prev(after)->value;
}

Misfit MisfitOf(const DiagnosedFlight& flight, const std::vector<ReplayError>& before,
                const std::vector<ReplayError>& after) {
  std::map<std::pair<int, double>, const ReplayError*> later;
  for (const ReplayError& replay : after) later[{replay.segment, replay.horizon}] = &replay;
  Misfit misfit;
  misfit.measured_by = flight.ReplaysAgainst();
  for (const ReplayError& replay : before) {
    const auto match = later.find({replay.segment, replay.horizon});
    if (!after.empty() && match == later.end()) continue;
    misfit.rows.push_back(
        {replay, after.empty() ? replay : *match->second, flight.SituationOf(replay)});
  }
  misfit.growth = GrowthOf(misfit.rows);
  // The median arc may have replaced the horizon of a second (Horizons in imu_errors.cc).
  for (const MisfitGrowth& g : misfit.growth) {
    if (std::abs(g.horizon - kHeldOutHorizon) < 0.12) misfit.shares_horizon = g.horizon;
  }
  misfit.shares = SharesOf(misfit.rows, misfit.shares_horizon);
  return misfit;
}

std::vector<int> QuantileBins(const std::vector<double>& values, int bins) {
  std::vector<double> sorted;
  for (const double v : values) {
    if (std::isfinite(v)) sorted.push_back(v);
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<int> bin;
  for (const double v : values) {
    const auto below = std::lower_bound(sorted.begin(), sorted.end(), v) - sorted.begin();
    const auto size = static_cast<long>(std::max<std::size_t>(1, sorted.size()));
    bin.push_back(std::isfinite(v) ? static_cast<int>(below * bins / size) : -1);
  }
  return bin;
}

VarianceShare VarianceShareOf(const std::vector<Eigen::Vector2d>& errors,
                              const std::vector<int>& bin) {
  std::map<int, std::pair<Eigen::Vector2d, int>> sums;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < errors.size(); ++i) {
    auto& [sum, count] = sums.try_emplace(bin[i], Eigen::Vector2d::Zero(), 0).first->second;
    sum += errors[i];
    ++count;
    mean += errors[i] / static_cast<double>(errors.size());
  }
  double within = 0.0, total = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const auto& [sum, count] = sums.at(bin[i]);
    within += (errors[i] - sum / count).squaredNorm();
    total += (errors[i] - mean).squaredNorm();
  }
  const double n = static_cast<double>(errors.size()), k = static_cast<double>(sums.size());
  if (k < 2 || n <= k + 1 || total <= 0.0) return {0.0, 1.0};
  const double by_chance = (k - 1) * within / (n - k), between = total - within;
  const double F = (between / (k - 1)) / (within / (n - k));
  return {std::max(0.0, (between - by_chance) / total), FTail(F, 2 * (k - 1), 2 * (n - k))};
}

std::vector<std::string> Extraordinary(const std::vector<NoiseFinding>& noise) {
  std::vector<std::string> texts;
  for (const NoiseFinding& n : noise) {
    if (n.value > n.most) texts.push_back(fmt::format(fmt::runtime(n.text), n.value));
  }
  return texts;
}

double WhitenessOf(const std::vector<TimedResidual>& residuals, double apart) {
  double products = 0.0, squares = 0.0;
  for (std::size_t i = 1; i < residuals.size(); ++i) {
    if (residuals[i].t - residuals[i - 1].t >= apart) continue;
    const Eigen::VectorXd product = residuals[i - 1].value.cwiseProduct(residuals[i].value);
    products += product.sum();
    squares += product.squaredNorm();  // its variance, also under heavy tails
  }
  return squares > 0.0 ? std::erfc(std::abs(products) / std::sqrt(2.0 * squares)) : 1.0;
}

std::vector<TimedResidual> SumsOfBlocks(const std::vector<TimedResidual>& residuals,
                                        double length) {
  std::vector<TimedResidual> blocks;
  for (const TimedResidual& r : residuals) {
    if (blocks.empty() || r.t >= blocks.back().t + length) {
      blocks.push_back(r);
    } else {
      blocks.back().value += r.value;
    }
  }
  return blocks;
}

}  // namespace trueline
