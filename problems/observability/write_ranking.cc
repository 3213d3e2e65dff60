// RankingYaml and RankingTable.
#include <fmt/ranges.h>

#include <cmath>

#include "problems/common/app.h"
#include "problems/observability/gramian_ranking.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

std::string RankText(double value) { return Rounded(value, 4); }

YAML::Node OptionsNode(const RankingOptions& options) {
  YAML::Node node;
  node["sensors"] = options.sensors;
  node["show"] = options.show;
  node["free"] = options.free;
  node["order"] = options.e2log.order;
  node["segment"] = RankText(options.e2log.segment);
  node["segments"] = options.e2log.chained ? "chained" : "summed";
  node["others"] = options.marginalise ? "marginalised" : "known";
  node["weighting"] = options.weigh_by_noise ? "noise" : "none";
  node["scale"] = kColumnScales[static_cast<std::size_t>(options.scale.kind)];
  node["scale_flights"] = options.scale.flights;
  node["scale_seed"] = options.scale.seed;
  for (const char* list : {"sensors", "show", "free"}) {
    node[list].SetStyle(YAML::EmitterStyle::Flow);
  }
  return node;
}

YAML::Node ByConstant(const std::vector<StateInfo>& shown, const std::vector<double>& values,
                      bool units) {
  YAML::Node node;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    node[shown[i].name] = units ? FlowMap({{"value", RankText(values[i])}, {"unit", shown[i].unit}})
                                : YAML::Node(RankText(values[i]));
  }
  return node;
}

YAML::Node FlightNode(const Ranking& ranking, std::size_t i) {
  const RankedFlight& flight = ranking.flights[i];
  YAML::Node node;
  node["rank"] = i + 1;
  node["name"] = flight.name;
  node["duration"] = FlowMap({{"value", RankText(flight.duration)}, {"unit", "s"}});
  node["sigma_min"] = RankText(flight.scores.sigma_min);
  node["condition"] = RankText(flight.scores.condition);
  node["log10_determinant"] = RankText(flight.scores.log10_determinant);
  node["per_state"] = ByConstant(ranking.shown, flight.scores.per_state, false);
  node["crlb"] = ByConstant(ranking.shown, flight.sigma, true);
  return node;
}

}  // namespace

std::string RankingYaml(const Ranking& ranking, const std::string& source) {
  YAML::Node node;
  node["provenance"]["version"] = Version();
  node["provenance"]["source"] = source;
  node["score"] = "e2log";
  node["options"] = OptionsNode(ranking.options);
  node["column_scale"] = ByConstant(ranking.shown, ranking.scale, true);
  for (std::size_t i = 0; i < ranking.flights.size(); ++i) {
    node["flights"].push_back(FlightNode(ranking, i));
  }
  return TextOf(node);
}

std::string RankingTable(const Ranking& ranking) {
  const RankingOptions& options = ranking.options;
  std::string text = fmt::format(
      "sigma_min of the E2LOG Gramian of {}, order {}, segments of {:g} s {}, other states {}, "
      "outputs weighted by {}, columns scaled by {}\nsigma: Cramer-Rao bound by the sensors' "
      "noise, all states unknown\n\n{:>4}  {:>11} {:>10}",
      fmt::join(options.show, ", "), options.e2log.order, options.e2log.segment,
      options.e2log.chained ? "chained" : "summed",
      options.marginalise ? "marginalised" : "taken as known",
      options.weigh_by_noise ? "noise" : "nothing",
      kColumnScales[static_cast<std::size_t>(options.scale.kind)], "rank", "sigma_min",
      "condition");
  for (const StateInfo& info : ranking.shown) {
    text += fmt::format(" {:>14}", fmt::format("{} [{}]", info.name, info.unit));
  }
  text += "  flight\n";
  for (std::size_t i = 0; i < ranking.flights.size(); ++i) {
    const RankedFlight& flight = ranking.flights[i];
    text += fmt::format("{:>4}  {:>11.4g} {:>10.3g}", i + 1, flight.scores.sigma_min,
                        flight.scores.condition);
    for (const double sigma : flight.sigma) text += fmt::format(" {:>14.3g}", sigma);
    text += "  " + flight.name + "\n";
  }
  return text;
}

}  // namespace trueline
