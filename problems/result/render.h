// The HTML report, rendered from the result files by the Python scripts that ship with the program.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace trueline {

// Runs report.py VERB with `arguments`, which writes directory/report.html. The other results are
// complete without the report, so a failure (no Python, no plotly) is returned as a warning text;
// empty on success.
std::string RenderReport(const std::string& verb, const std::vector<std::string>& arguments,
                         const std::filesystem::path& directory);

}  // namespace trueline
