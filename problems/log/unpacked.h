// Files as people pack them: gzip, bzip2, xz, zstd, zip and tar, also one in another.
#pragma once

#include <filesystem>

namespace trueline {

// The path of the content: `path` itself where it is not packed, else a temporary file, or a folder
// for an archive of several files, that lasts until the program ends. A packed file is unpacked
// once. Throws InputError, with the user's name of the file, where it is damaged or where there is
// no room.
std::filesystem::path Unpacked(const std::filesystem::path& path);

// A path in the same temporary folder, of a file that another one is rewritten to.
std::filesystem::path TemporaryFor(const std::filesystem::path& path);

}  // namespace trueline
