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

// What a terminal gets of a result: `whole` where that fits a screen or is asked for, else `brief`.
std::string OneScreen(const std::string& whole, const std::string& brief, bool verbose);

// Ends a run: renders the report VERB if `report`, commits the result folder, prints the table
// unless `quiet`. report.py gets the result folder and the arguments in `more`. Throws InputError
// at the end if the report failed: the other results are complete, worth writing and printing.
void Publish(const std::string& verb, bool report, bool quiet, const std::string& table,
             ResultFolder* out, const std::vector<std::string>& more = {});

}  // namespace trueline
