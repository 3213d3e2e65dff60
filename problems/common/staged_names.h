// Names for messages of files that a run keeps in a hidden folder until it is complete.
#pragma once

#include <filesystem>
#include <string>

namespace trueline {

// From now on WithFinalNames replaces `stage` by `final_name`, in all threads.
void NameStage(const std::filesystem::path& stage, const std::filesystem::path& final_name);

// `text` with the names that the user knows.
std::string WithFinalNames(std::string text);

}  // namespace trueline
