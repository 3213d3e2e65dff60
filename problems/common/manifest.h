// manifest.yaml of a result folder: which program wrote which files, with their digests.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace trueline {

inline constexpr char kManifestFile[] = "manifest.yaml";

struct Manifest {
  std::string program;             // "trueline-calibrate"
  std::vector<std::string> files;  // names without folders
};

// Lists every file in `folder`: its name and the SHA-256 of its bytes.
void WriteManifest(const std::filesystem::path& folder, const std::string& program);

// Empty where there is no manifest, or one that no program of Trueline wrote.
Manifest ReadManifest(const std::filesystem::path& folder);

}  // namespace trueline
