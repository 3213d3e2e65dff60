// What a user does with a diagnosis, in words: on the terminal, in diagnosis.yaml and on the page.
#pragma once

#include <string>
#include <vector>

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// What the verdict means, in one sentence.
std::string VerdictMeaning(const Diagnosis& diagnosis);

// The most useful step first; never empty.
std::vector<std::string> NextSteps(const Diagnosis& diagnosis);

}  // namespace trueline
