// Values in result files: numbers with significant digits only, any text in quotes.
#pragma once

#include <yaml-cpp/yaml.h>

#include <initializer_list>
#include <string>
#include <utility>

namespace trueline {

// A scalar of a node with that many significant digits: 0.0268, not 0.026800000000000001. Reads
// back as a number by YAML 1.1 and 1.2 (1.0e-05, .nan, -.inf).
std::string Rounded(double value, int digits);
// The same, but exact for a whole number: the id of a gate.
std::string RoundedOrWhole(double value, int digits);

// A text in double quotes, whatever it holds: paths and names may have colons, quotes, backslashes.
std::string Quoted(const std::string& text);

// {key: value, ...} on one line; the values as text.
YAML::Node FlowMap(std::initializer_list<std::pair<const char*, std::string>> entries);

// The file's text, its end of line included.
std::string TextOf(const YAML::Node& node);

}  // namespace trueline
