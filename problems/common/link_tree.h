// Files that stay when one folder takes the place of another.
#pragma once

#include <filesystem>
#include <set>
#include <string>

namespace trueline {

// Gives what `from` holds a second name in `to`, folders with all that is in them; copies where the
// file system has no second names. Left out: files named in `skip`, and names that `to` has. Throws
// InputError if a folder in `from` has the name of a file in `to`, or if the disk is full.
void LinkTree(const std::filesystem::path& from, const std::filesystem::path& to,
              const std::set<std::string>& skip);

// Removes `from` after LinkTree(). What came into it since then moves to `to`.
void RemoveLinked(const std::filesystem::path& from, const std::filesystem::path& to,
                  const std::set<std::string>& skip);

}  // namespace trueline
