// The formats of parameter files: YAML, XML, lists of PX4 parameters and TOML.
#include <fmt/format.h>
#include <toml++/toml.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <pugixml.hpp>
#include <string>

#include "problems/common/error.h"
#include "problems/simulators/parameter_file.h"

namespace trueline {
namespace {

// Past an anchor, a tag and a quote, which stand before a scalar.
std::size_t BeginOfScalar(const std::string& source, std::size_t at) {
  while (at < source.size() && (source[at] == '&' || source[at] == '!')) {
    at = std::min(source.find_first_of(" \t\n", at), source.size());
    at = std::min(source.find_first_not_of(" \t\n", at), source.size());
  }
  return at < source.size() && (source[at] == '"' || source[at] == '\'') ? at + 1 : at;
}

FileNode YamlTree(const YAML::Node& node, const std::string& name, const std::string& source) {
  FileNode tree{name, "", {}};
  tree.place.line = node.Mark().line + 1;
  if (node.IsMap()) {
    FileNode merged;  // what "<<: *anchor" adds, beside what stands here itself
    for (const auto& entry : node) {
      const std::string key = entry.first.Scalar();
      FileNode child = YamlTree(entry.second, key, source);
      if (key == "<<") {
        const bool list = entry.second.IsSequence();
        for (FileNode& from : list ? child.children : std::vector<FileNode>{child}) {
          merged.children.insert(merged.children.end(), from.children.begin(), from.children.end());
        }
        continue;
      }
      if (tree.Child(key) != nullptr) {
        throw YAML::Exception(entry.first.Mark(), "'" + key + "' is stated twice");
      }
      tree.children.push_back(std::move(child));
    }
    for (FileNode& child : merged.children) {
      if (tree.Child(child.name) == nullptr) tree.children.push_back(std::move(child));
    }
  } else if (node.IsSequence()) {
    for (std::size_t i = 0; i < node.size(); ++i) {
      tree.children.push_back(YamlTree(node[i], std::to_string(i), source));
    }
  } else if (node.IsScalar()) {
    tree.text = node.Scalar();
    const auto at = static_cast<std::size_t>(std::max(0, node.Mark().pos));
    const std::size_t begin = BeginOfScalar(source, std::min(at, source.size()));
    tree.place.begin = tree.place.end = begin;
    if (source.compare(begin, tree.text.size(), tree.text) == 0) {
      tree.place.end = begin + tree.text.size();
    }
  }
  return tree;
}

// The value of an attribute in the start tag at `begin`: pugixml states places of elements only.
FilePlace AttributePlace(const std::string& text, std::size_t begin, const std::string& name) {
  std::size_t i = begin;
  while (i < text.size() && text[i] != '>') {
    while (i < text.size() && text[i] != '=' && text[i] != '>') ++i;
    std::size_t last = i;
    while (last > begin && std::isspace(static_cast<unsigned char>(text[last - 1])) != 0) --last;
    std::size_t first = last;
    while (first > begin && std::isspace(static_cast<unsigned char>(text[first - 1])) == 0) --first;
    const std::size_t open = text.find_first_of("\"'", i);
    if (open == std::string::npos) break;
    const std::size_t close = text.find(text[open], open + 1);
    if (close == std::string::npos) break;
    if (text.compare(first, last - first, name) == 0) {
      return {open + 1, close, LineOfByte(text, open)};
    }
    i = close + 1;
  }
  return {begin, begin, LineOfByte(text, begin)};
}

FileNode XmlTree(const pugi::xml_node& node, const std::string& text) {
  const auto begin = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, node.offset_debug()));
  FileNode tree{node.name(), "", {begin, begin, LineOfByte(text, begin)}};
  for (const pugi::xml_attribute& attribute : node.attributes()) {
    tree.children.push_back({std::string("@") + attribute.name(), attribute.value(),
                             AttributePlace(text, begin, attribute.name())});
  }
  for (const pugi::xml_node& child : node.children()) {
    if (child.type() == pugi::node_element) tree.children.push_back(XmlTree(child, text));
    const bool text_node = child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata;
    if (!text_node || !tree.text.empty()) continue;
    tree.text = child.value();
    const auto at = static_cast<std::size_t>(child.offset_debug());
    const std::size_t first = tree.text.find_first_not_of(" \t\r\n");
    const std::size_t last = tree.text.find_last_not_of(" \t\r\n");
    tree.text = first == std::string::npos ? "" : tree.text.substr(first, last + 1 - first);
    tree.place.begin = at + (first == std::string::npos ? 0 : first);
    // Where entities stand for characters, the bytes are others: it is read only.
    const bool same = text.compare(tree.place.begin, tree.text.size(), tree.text) == 0;
    tree.place.end = tree.place.begin + (same ? tree.text.size() : 0);
    tree.place.line = LineOfByte(text, tree.place.begin);
  }
  return tree;
}

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

// Program code with plain numbers, C++ or Python: its assignments, keyword arguments and
// dictionaries as a tree. Nothing is run.
//   vehicle.rotor.C_T = 0.1;               a leaf C_T
//   box.x() = 0.2;                         a leaf box.x
//   name=Call(a=1.0, b=(2.0, 3.0))         name with children a and b; b with 0 and 1
//   {"name": [[1.0, 2.0]]}                 name/0/0

bool IsWordStart(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool IsWord(char c) { return IsWordStart(c) || std::isdigit(static_cast<unsigned char>(c)) != 0; }

class CodeParser {
 public:
  CodeParser(const std::filesystem::path& path, const std::string& text)
      : path_(path), text_(text), python_(path.extension() == ".py") {}

  FileNode Parse() {
    FileNode root{"", "", {}};
    Items(&root, '\0');
    RefuseSeveral(root);
    // A dictionary that holds a vehicle counts as the file.
    for (std::size_t i = 0, all = root.children.size(); i < all; ++i) {
      const std::vector<FileNode> inside = root.children[i].children;
      root.children.insert(root.children.end(), inside.begin(), inside.end());
    }
    return root;
  }

 private:
  char At(std::size_t i) const { return i < text_.size() ? text_[i] : '\0'; }

  // Past blanks and comments.
  void Skip() {
    for (;;) {
      while (std::isspace(static_cast<unsigned char>(At(at_))) != 0) ++at_;
      const bool line = python_ ? At(at_) == '#' : text_.compare(at_, 2, "//") == 0;
      const bool block = !python_ && text_.compare(at_, 2, "/*") == 0;
      if (!line && !block) return;
      const std::size_t end = text_.find(line ? "\n" : "*/", at_);
      at_ = end == std::string::npos ? text_.size() : end + (line ? 1 : 2);
    }
  }

  // The contents of a text in quotes, one or three.
  std::string Quoted() {
    const std::string mark = text_.compare(at_, 3, std::string(3, At(at_))) == 0
                                 ? std::string(3, At(at_))
                                 : std::string(1, At(at_));
    const std::size_t begin = at_ + mark.size(), end = text_.find(mark, begin);
    at_ = end == std::string::npos ? text_.size() : end + mark.size();
    return text_.substr(begin, end == std::string::npos ? end : end - begin);
  }

  // a.b->c: its last name; of an accessor (box.x()) the last two.
  std::string Name() {
    std::string before, last;
    for (;;) {
      const std::size_t begin = at_;
      while (IsWord(At(at_))) ++at_;
      before = std::move(last);
      last = text_.substr(begin, at_ - begin);
      const std::size_t dot = At(at_) == '.' ? 1 : text_.compare(at_, 2, "->") == 0 ? 2 : 0;
      if (dot == 0 || !IsWordStart(At(at_ + dot))) break;
      at_ += dot;
    }
    if (text_.compare(at_, 2, "()") != 0 || before.empty()) return last;
    at_ += 2;
    return before + "." + last;
  }

  static char Closing(char open) { return open == '(' ? ')' : open == '[' ? ']' : '}'; }
  bool Opens() const { return At(at_) == '(' || At(at_) == '[' || At(at_) == '{'; }

  // Everything up to `close` (0: the end) that has a name or, in a list, a place.
  void Items(FileNode* node, char close) {
    int count = 0;
    for (Skip(); at_ < text_.size() && At(at_) != close; Skip()) {
      const std::size_t begin = at_;
      const std::string name = At(at_) == '"' || At(at_) == '\'' ? Quoted()
                               : IsWordStart(At(at_))            ? Name()
                                                                 : "";
      Skip();
      const bool equals = At(at_) == '=' && At(at_ + 1) != '=';
      if (!name.empty() && (equals || (python_ && At(at_) == ':'))) {
        ++at_;
        node->children.push_back(Value(name));
      } else if (close == ')' || close == ']') {
        at_ = begin;
        if (At(at_) == ',' || At(at_) == ';') {
          ++at_;
        } else {
          node->children.push_back(Value(std::to_string(count++)));
          if (at_ == begin) ++at_;
        }
      } else if (name.empty()) {
        Opens() ? Nested(node) : Step();
      }
    }
    Step();
  }

  // The text may end anywhere.
  void Step() { at_ = std::min(at_ + 1, text_.size()); }

  void Nested(FileNode* node) {
    constexpr int kMostBrackets = 100;
    if (++depth_ > kMostBrackets) {
      throw ErrorAt(path_.string(), LineOfByte(text_, at_),
                    "nests brackets too deeply; give the file that holds the numbers");
    }
    const char close = Closing(At(at_));
    ++at_;
    Items(node, close);
    --depth_;
  }

  FileNode Value(const std::string& name) {
    Skip();
    const std::size_t begin = at_;
    FileNode node{name, "", {begin, begin, LineOfByte(text_, begin)}, {}};
    if (IsWordStart(At(at_))) {
      Name();
      Skip();
      if (python_ && At(at_) == '=' && At(at_ + 1) != '=') {  // name: type = value
        ++at_;
        return Value(name);
      }
    }
    if (Opens()) {
      Nested(&node);
      // array([...]) is its list.
      while (node.children.size() == 1 && !node.children[0].children.empty() &&
             node.children[0].name == "0" && IsWordStart(At(begin))) {
        const std::vector<FileNode> inside = node.children[0].children;
        node.children = inside;
      }
      if (!node.children.empty()) return node;
    }
    at_ = begin;
    while (at_ < text_.size() && std::string(",;)]}\n#").find(At(at_)) == std::string::npos) ++at_;
    std::size_t end = at_;
    while (end > begin && std::isspace(static_cast<unsigned char>(text_[end - 1])) != 0) --end;
    // 1.0f
    if (!python_ && end > begin + 1 && text_[end - 1] == 'f' && !IsWordStart(text_[end - 2])) --end;
    node.text = text_.substr(begin, end - begin);
    node.place.end = end;
    return node;
  }

  // Code of several vehicles assigns a name to each in turn.
  void RefuseSeveral(const FileNode& node) const {
    std::map<std::string, const FileNode*> seen;
    for (const FileNode& child : node.children) {
      RefuseSeveral(child);
      if (child.text.empty() || std::isdigit(static_cast<unsigned char>(child.text[0])) == 0)
        continue;
      const auto [first, is_new] = seen.try_emplace(child.name, &child);
      if (is_new || first->second->text == child.text) continue;
      throw ErrorAt(
          path_.string(), child.place.line,
          fmt::format("'{}' is {} here and {} in line {}; keep the numbers of one vehicle",
                      child.name, child.text, first->second->text, first->second->place.line));
    }
  }

  const std::filesystem::path& path_;
  const std::string& text_;
  bool python_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

FileNode ParseYamlFile(const std::filesystem::path& path, const std::string& text) {
  try {
    return YamlTree(YAML::Load(text), "", text);
  } catch (const YAML::Exception& error) {
    throw ErrorAt(path.string(), error.mark.line + 1, "is no valid YAML: " + error.msg);
  }
}

FileNode ParseXmlFile(const std::filesystem::path& path, const std::string& text) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    const auto at = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, parsed.offset));
    throw ErrorAt(path.string(), LineOfByte(text, at),
                  fmt::format("is no valid XML: {}; of a template, give the file that it makes",
                              parsed.description()));
  }
  FileNode root{"", "", {}};
  for (const pugi::xml_node& child : document.children()) {
    if (child.type() == pugi::node_element) root.children.push_back(XmlTree(child, text));
  }
  return root;
}

// Lines "param set-default NAME value" of an airframe, or a ground station's "1 1 NAME value 9".
FileNode ParsePx4File(const std::filesystem::path& /*path*/, const std::string& text) {
  FileNode root{"", "", {}};
  std::size_t begin = 0;
  for (int line = 1; begin < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::vector<FilePlace> words;
    for (std::size_t i = begin; i < end && text[i] != '#';) {
      if (std::isspace(static_cast<unsigned char>(text[i])) != 0) {
        ++i;
        continue;
      }
      const std::size_t stop = std::min(text.find_first_of(" \t\r\n#", i), end);
      words.push_back({i, stop, line});
      i = stop;
    }
    const auto word = [&](std::size_t i) {
      return text.substr(words[i].begin, words[i].end - words[i].begin);
    };
    const bool set = words.size() >= 4 && word(0) == "param" && word(1).starts_with("set");
    const bool listed = words.size() == 5 && std::isdigit(text[words[0].begin]) != 0;
    if (set || listed) {
      std::erase_if(root.children, [&](const FileNode& n) { return n.name == word(2); });
      root.children.push_back({word(2), word(3), words[3]});  // the last counts
    }
    begin = end + 1;
  }
  return root;
}

FileNode ParseTomlFile(const std::filesystem::path& path, const std::string& text) {
  try {
    return TomlTree(toml::parse(text), "", text);
  } catch (const toml::parse_error& error) {
    throw ErrorAt(path.string(), static_cast<int>(error.source().begin.line),
                  fmt::format("is no valid TOML: {}", error.description()));
  }
}

FileNode ParseCodeFile(const std::filesystem::path& path, const std::string& text) {
  return CodeParser(path, text).Parse();
}

}  // namespace trueline
