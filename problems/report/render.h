// The HTML report: made by the Python scripts that ship with the program, from the result files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace trueline {

// Runs report.py VERB with `arguments` and has it write directory/report.html. The other results
// are complete without the report, so a failure (no Python, no plotly) is returned as text of a
// warning, empty where all went well.
std::string RenderReport(const std::string& verb, const std::vector<std::string>& arguments,
                         const std::filesystem::path& directory);

}  // namespace trueline
