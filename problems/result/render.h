// The HTML report, rendered from the result files by the Python scripts that ship with the program.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace trueline {

// Runs report.py VERB with `arguments`, which writes directory/report.html. A failure (no Python,
// no plotly, no space) is returned as a text, empty on success: the other results are worth writing
// and printing before RequireReport() turns it into the end of the run.
std::string RenderReport(const std::string& verb, const std::vector<std::string>& arguments,
                         const std::filesystem::path& directory);

// Throws InputError with the text, if it is not empty.
void RequireReport(const std::string& failure);

}  // namespace trueline
