// The HTML report, rendered from the result files by the Python scripts that ship with the program.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/common/result_folder.h"

namespace trueline {

// Runs report.py VERB with `arguments`, which writes `out`. A failure (no Python, no plotly, no
// space) is returned as a text, empty on success.
std::string RunReport(const std::string& verb, const std::vector<std::string>& arguments,
                      const std::filesystem::path& out);

// The same for directory/report.html. A failure says that the other results are complete: they are
// worth writing and printing before the run ends in it.
std::string RenderReport(const std::string& verb, const std::vector<std::string>& arguments,
                         const std::filesystem::path& directory);

// Ends a run: renders the report VERB if `report`, commits the result folder, prints the table
// unless `quiet`. report.py gets the result folder and the arguments in `more`. Throws InputError
// at the end if the report failed.
void Publish(const std::string& verb, bool report, bool quiet, const std::string& table,
             ResultFolder* out, const std::vector<std::string>& more = {});

}  // namespace trueline
