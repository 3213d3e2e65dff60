#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>

#include "problems/common/error.h"
#include "problems/simulators/parameter_file.h"

namespace trueline {
namespace {

// The byte of a line and column, both from 1.
std::size_t ByteAt(const std::string& text, const toml::source_position& at) {
  std::size_t byte = 0;
  for (toml::source_index line = 1; line < at.line; ++line) byte = text.find('\n', byte) + 1;
  for (toml::source_index column = 1; column < at.column && byte < text.size(); ++column) {
    do {
      ++byte;
    } while (byte < text.size() && (static_cast<unsigned char>(text[byte]) & 0xC0U) == 0x80U);
  }
  return byte;
}

FileNode TomlTree(const toml::node& node, const std::string& name, const std::string& text) {
  FileNode tree{name, "", {}};
  tree.place.line = static_cast<int>(node.source().begin.line);
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      tree.children.push_back(TomlTree(value, std::string(key.str()), text));
    }
    std::stable_sort(
        tree.children.begin(), tree.children.end(),
        [](const FileNode& a, const FileNode& b) { return a.place.line < b.place.line; });
  } else if (const toml::array* array = node.as_array()) {
    for (const toml::node& value : *array) {
      tree.children.push_back(TomlTree(value, std::to_string(tree.children.size()), text));
    }
  } else {
    tree.place.begin = ByteAt(text, node.source().begin);
    tree.place.end = ByteAt(text, node.source().end);
    tree.text = text.substr(tree.place.begin, tree.place.end - tree.place.begin);
  }
  return tree;
}

}  // namespace

FileNode ParseTomlFile(const std::filesystem::path& path, const std::string& text) {
  try {
    return TomlTree(toml::parse(text), "", text);
  } catch (const toml::parse_error& error) {
    throw ErrorAt(path.string(), static_cast<int>(error.source().begin.line),
                  fmt::format("is no valid TOML: {}", error.description()));
  }
}

}  // namespace trueline
