// Program code with plain numbers, C++ or Python: its assignments, keyword arguments and
// dictionaries as a tree. Nothing is run.
//   vehicle.rotor.C_T = 0.1;               a leaf C_T
//   box.x() = 0.2;                         a leaf box.x
//   name=Call(a=1.0, b=(2.0, 3.0))         name with children a and b; b with 0 and 1
//   {"name": [[1.0, 2.0]]}                 name/0/0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <string>

#include "problems/common/error.h"
#include "problems/simulators/parameter_file.h"

namespace trueline {
namespace {

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

FileNode ParseCodeFile(const std::filesystem::path& path, const std::string& text) {
  return CodeParser(path, text).Parse();
}

}  // namespace trueline
