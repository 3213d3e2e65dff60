#include "problems/common/manifest.h"

#include <yaml-cpp/yaml.h>

#include <map>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/sha256.h"

namespace trueline {
namespace fs = std::filesystem;

void WriteManifest(const fs::path& folder, const std::string& program) {
  std::map<std::string, std::string> digests;
  for (const auto& entry : fs::directory_iterator(folder)) {
    digests[entry.path().filename().string()] = Sha256OfFile(entry.path());
  }
  YAML::Emitter text;
  text << YAML::BeginMap << YAML::Key << "program" << YAML::Value << program;
  text << YAML::Key << "version" << YAML::Value << Version();
  text << YAML::Key << "sha256" << YAML::Value << digests << YAML::EndMap << YAML::Newline;
  WriteFileAtomically(folder / kManifestFile, text.c_str());
}

Manifest ReadManifest(const fs::path& folder) {
  Manifest manifest;
  try {
    const YAML::Node node = YAML::LoadFile((folder / kManifestFile).string());
    const auto program = node["program"].as<std::string>();
    if (!program.starts_with("trueline-")) return {};
    manifest.program = program;
    for (const auto& entry : node["sha256"]) {
      const auto name = entry.first.as<std::string>();
      if (fs::path(name).filename() == name && name != "." && name != "..") {
        manifest.files.push_back(name);
      }
    }
  } catch (const YAML::Exception&) {
    return {};
  }
  return manifest;
}

}  // namespace trueline
