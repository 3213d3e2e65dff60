#include "problems/diagnosis/choose_model.h"

#include <algorithm>
#include <cmath>

#include "problems/diagnosis/rules.h"

namespace trueline {
namespace {

// Adds the terms that no other flight contradicts.
void ChooseTerms(const std::vector<Found>& terms, Diagnosis* diagnosis, std::vector<Found>* model) {
  std::size_t next = 0;
  for (DescribedTerm& t : diagnosis->open.described) {
    if (!t.in_model) continue;
    t.in_model = t.confirmed.value_or(true);
    if (t.in_model) model->push_back(terms[next]);
    ++next;
  }
}

void AddTermsToModel(const std::vector<Found>& model, std::size_t first, Diagnosis* diagnosis) {
  for (const DescribedTerm& t : diagnosis->open.described) {
    if (!t.in_model) continue;
    Effect effect = model[first++].effect();
    effect.values["sigma"] = t.size.sigma;
    diagnosis->in_model.push_back(effect);
  }
}

}  // namespace

void WidenByChange(const std::vector<ParameterEstimate>& with,
                   std::vector<ParameterEstimate>* without) {
  for (ParameterEstimate& estimate : *without) {
    const auto before = std::ranges::find(with, estimate.name, &ParameterEstimate::name);
    if (before == with.end()) continue;
    estimate.sigma = std::hypot(estimate.sigma, estimate.value - before->value);
  }
}

void ChooseModel(const Rounds& rounds, const std::vector<Found>& terms, DiagnosedFlight* flight,
                 Diagnosis* diagnosis) {
  std::vector<Found> model = rounds.found;
  const auto& causes = diagnosis->causes;
  const std::size_t false_data = causes.size() - rounds.found.size();
  for (std::size_t i = causes.size(); i-- > 0;) {
    if (Claimed(causes[i])) {
      diagnosis->in_model.insert(diagnosis->in_model.begin(), causes[i].effect());
    } else if (i >= false_data) {
      EraseAt(i - false_data, &model);
    }
  }
  if (diagnosis->in_model.size() < causes.size()) {
    diagnosis->model_lacks = "causes that no other flight confirms";
  }
  const std::size_t chosen = model.size();
  ChooseTerms(terms, diagnosis, &model);
  if (model.size() < rounds.found.size() + terms.size()) {
    flight->Fit(&model);
    Diagnosis refitted;
    flight->Describe(&refitted);
    WidenByChange(diagnosis->parameters, &refitted.parameters);
    diagnosis->parameters = refitted.parameters;
    const std::size_t first = diagnosis->in_model.size() - chosen;
    for (std::size_t k = 0; k < chosen; ++k) {
      diagnosis->in_model[first + k] = model[k].effect();
    }
  }
  AddTermsToModel(model, chosen, diagnosis);
  const std::vector<Effect> known = flight->KnownEffects();
  diagnosis->in_model.insert(diagnosis->in_model.begin(), known.begin(), known.end());
}

}  // namespace trueline
