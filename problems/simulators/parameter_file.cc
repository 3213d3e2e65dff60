#include "problems/simulators/parameter_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <sstream>

#include "problems/common/error.h"

namespace trueline {
namespace {

constexpr int kDeepest = 16;  // of xacro properties that name each other

bool IsSpace(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

bool ReadsAsNumber(const std::string& text, double* value) {
  const char* begin = text.c_str();
  char* end = nullptr;
  *value = std::strtod(begin, &end);
  // strtod takes hexadecimal numbers, nan and inf, which no format means here.
  return end != begin && *end == '\0' && std::isfinite(*value) &&
         text.find_first_not_of("0123456789+-.eE") == std::string::npos;
}

// Sums and products of numbers and names, as xacro writes them.
class Expression {
 public:
  using Lookup = std::function<double(const std::string&)>;
  Expression(std::string text, Lookup lookup)
      : text_(std::move(text)), lookup_(std::move(lookup)) {}

  // False where it is none.
  bool Value(double* value) {
    *value = Sum();
    Skip();
    return good_ && at_ == text_.size();
  }

 private:
  void Skip() {
    while (at_ < text_.size() && IsSpace(text_[at_])) ++at_;
  }
  bool Eat(char c) {
    Skip();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  // Terms with the operators `add` or `take` between them, which change the value so.
  double Sum() { return Chain('+', '-', &Expression::Product, std::plus(), std::minus()); }
  double Product() {
    return Chain('*', '/', &Expression::Factor, std::multiplies(), std::divides());
  }
  double Chain(char add, char take, double (Expression::*term)(), auto with, auto without) {
    double value = (this->*term)();
    for (;;) {
      if (Eat(add)) {
        value = with(value, (this->*term)());
      } else if (Eat(take)) {
        value = without(value, (this->*term)());
      } else {
        return value;
      }
    }
  }
  double Factor() {
    if (Eat('-')) return -Factor();
    if (Eat('(')) {
      const double value = Sum();
      good_ = good_ && Eat(')');
      return value;
    }
    Skip();
    const std::size_t begin = at_;
    if (at_ < text_.size() && (std::isalpha(static_cast<unsigned char>(text_[at_])) != 0)) {
      while (at_ < text_.size() &&
             (std::isalnum(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '_')) {
        ++at_;
      }
      return lookup_(text_.substr(begin, at_ - begin));
    }
    char* end = nullptr;
    const double value = std::strtod(text_.c_str() + begin, &end);
    at_ = static_cast<std::size_t>(end - text_.c_str());
    good_ = good_ && at_ > begin;
    return value;
  }

  std::string text_;
  Lookup lookup_;
  std::size_t at_ = 0;
  bool good_ = true;
};

// The text without ${ and }, if it holds an expression of xacro.
bool IsExpression(const std::string& text, std::string* inside) {
  *inside = text;
  bool found = false;
  for (std::size_t at; (at = inside->find("${")) != std::string::npos; found = true) {
    const std::size_t close = inside->find('}', at);
    if (close == std::string::npos) return false;
    (*inside)[close] = ')';
    inside->replace(at, 2, "(");
  }
  return found;
}

// "(mass)" -> "mass"; empty where it is more than a name.
std::string OnlyName(const std::string& inside) {
  if (inside.size() < 3 || inside.front() != '(' || inside.back() != ')') return "";
  const std::string name = inside.substr(1, inside.size() - 2);
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
  });
  return plain && std::isalpha(static_cast<unsigned char>(name[0])) != 0 ? name : "";
}

// Words of a text of several numbers; what stands in ${...} is one word.
std::vector<FileNode> Words(const FileNode& leaf) {
  std::vector<FileNode> words;
  const std::string& text = leaf.text;
  int line = leaf.place.line;
  for (std::size_t i = 0; i < text.size();) {
    if (IsSpace(text[i])) {
      line += text[i++] == '\n' ? 1 : 0;
      continue;
    }
    std::size_t end = i;
    for (int depth = 0; end < text.size() && (depth > 0 || !IsSpace(text[end])); ++end) {
      depth += text[end] == '{' ? 1 : text[end] == '}' ? -1 : 0;
    }
    words.push_back({std::to_string(words.size()),
                     text.substr(i, end - i),
                     {leaf.place.begin + i, leaf.place.begin + end, line}});
    i = end;
  }
  return words;
}

void AllNamed(const FileNode& node, const std::string& name, std::vector<const FileNode*>* found) {
  for (const FileNode& child : node.children) {
    if (child.name == name) found->push_back(&child);
    AllNamed(child, name, found);
  }
}

// NAME or NAME[key=value].
struct Step {
  std::string name, key, value;

  explicit Step(const std::string& text) {
    const std::size_t open = text.find('['), equal = text.find('=', open);
    name = text.substr(0, open);
    if (open == std::string::npos || equal == std::string::npos) return;
    key = text.substr(open + 1, equal - open - 1);
    value = text.substr(equal + 1, text.rfind(']') - equal - 1);
  }
  bool Fits(const FileNode& node) const {
    if (node.name != name) return false;
    if (key.empty()) return true;
    const FileNode* attribute = node.Child("@" + key);
    const FileNode* leaf = attribute != nullptr ? attribute : node.Child(key);
    return leaf != nullptr && leaf->text == value;
  }
};

// At '/' outside of [...].
std::vector<std::string> Steps(const std::string& path) {
  std::vector<std::string> steps(1);
  int depth = 0;
  for (const char c : path) {
    depth += c == '[' ? 1 : c == ']' ? -1 : 0;
    if (c == '/' && depth == 0) {
      steps.emplace_back();
    } else {
      steps.back() += c;
    }
  }
  return steps;
}

FileNode ParseByContent(const std::filesystem::path& path, const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (first == std::string::npos) {
    throw ErrorAt(path.string(), 0, "is empty; give a simulator's parameter file");
  }
  if (text[first] == '<') return ParseXmlFile(path, text);
  const std::string extension = path.extension().string();
  if (extension == ".toml") return ParseTomlFile(path, text);
  for (const char* code : {".py", ".cc", ".cpp", ".h", ".hpp", ".java"}) {
    if (extension == code) return ParseCodeFile(path, text);
  }
  if (FileNode parameters = ParsePx4File(path, text); !parameters.children.empty()) {
    return parameters;
  }
  return ParseYamlFile(path, text);
}

}  // namespace

const FileNode* FileNode::Child(const std::string& child) const {
  const auto found = std::find_if(children.begin(), children.end(),
                                  [&](const FileNode& node) { return node.name == child; });
  return found == children.end() ? nullptr : &*found;
}

int LineOfByte(const std::string& text, std::size_t byte) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(byte, text.size()));
  return 1 + static_cast<int>(std::count(text.begin(), end, '\n'));
}

std::string Edited(const std::string& text, std::vector<FileEdit> edits) {
  std::sort(edits.begin(), edits.end(),
            [](const FileEdit& a, const FileEdit& b) { return a.place.begin < b.place.begin; });
  std::string edited;
  std::size_t at = 0;
  for (const FileEdit& edit : edits) {
    if (edit.place.begin < at) continue;  // the same place twice
    edited += text.substr(at, edit.place.begin - at) + edit.text;
    at = edit.place.end;
  }
  return edited + text.substr(at);
}

ParameterFile::ParameterFile(std::filesystem::path path, std::string text)
    : path_(std::move(path)), text_(std::move(text)), root_(ParseByContent(path_, text_)) {}

ParameterFile ParameterFile::Read(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path)) {
    throw ErrorAt(path.string(), 0, "can't be read; give a simulator's parameter file");
  }
  std::ostringstream text;
  text << in.rdbuf();
  return ParameterFile(path, text.str());
}

ParameterFile ParameterFile::Parse(const std::filesystem::path& path, std::string text) {
  return ParameterFile(path, std::move(text));
}

std::vector<const FileNode*> ParameterFile::All(const std::string& name) const {
  std::vector<const FileNode*> found;
  AllNamed(root_, name, &found);
  return found;
}

const FileNode* ParameterFile::Find(const FileNode& from, const std::string& where) const {
  if (const std::size_t bar = where.find('|'); bar != std::string::npos) {
    const FileNode* first = Find(from, where.substr(0, bar));
    return first != nullptr ? first : Find(from, where.substr(bar + 1));
  }
  const bool deep = where.starts_with("//");
  const FileNode* node = &from;
  const std::vector<std::string> steps = Steps(deep ? where.substr(2) : where);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step step(steps[i]);
    const FileNode* next = nullptr;
    if (i == 0 && deep) {
      for (const FileNode* candidate : All(step.name)) {
        if (next == nullptr && step.Fits(*candidate)) next = candidate;
      }
    } else {
      for (const FileNode& child : node->children) {
        if (next == nullptr && step.Fits(child)) next = &child;
      }
      const bool index = std::isdigit(static_cast<unsigned char>(step.name[0])) != 0;
      if (next == nullptr && index && !node->text.empty()) {
        const std::vector<FileNode> words = Words(*node);
        const auto number = static_cast<std::size_t>(std::atoi(step.name.c_str()));
        if (number < words.size()) {
          tokens_.push_back(words[number]);
          next = &tokens_.back();
        }
      }
    }
    if (next == nullptr) return nullptr;
    node = next;
  }
  return node;
}

double ParameterFile::Evaluate(const FileNode& leaf, int depth) const {
  double value = 0.0;
  if (ReadsAsNumber(leaf.text, &value)) return value;
  const auto fail = [&](const std::string& remedy) {
    return ErrorAt(path_.string(), leaf.place.line,
                   fmt::format("'{}' under '{}' is no number; {}", leaf.text, leaf.name, remedy));
  };
  std::string inside;
  if (!IsExpression(leaf.text, &inside)) {
    double product = 0.0;
    if (Expression(leaf.text, [](const std::string&) { return NAN; }).Value(&product) &&
        std::isfinite(product)) {
      throw fail(fmt::format("simulators do not compute; write {:.9g}", product));
    }
    throw fail("write a plain number");
  }
  if (depth > kDeepest) throw fail("its properties name each other; write a plain number");
  const auto lookup = [&](const std::string& name) {
    if (name == "pi") return M_PI;
    const FileNode* property = Find("//xacro:property[name=" + name + "]/@value");
    if (property == nullptr) {
      throw fail("no property " + name + " stands in this file; give the file that xacro makes");
    }
    return Evaluate(*property, depth + 1);
  };
  if (!Expression(inside, lookup).Value(&value) || !std::isfinite(value)) {
    throw fail("only sums and products of numbers and properties are read; write a plain number");
  }
  return value;
}

double ParameterFile::NumberOf(const FileNode& leaf) const { return Evaluate(leaf, 0); }

const FileNode* ParameterFile::PlainNumber(const FileNode& leaf) const {
  double value = 0.0;
  if (ReadsAsNumber(leaf.text, &value)) {
    return leaf.place.end > leaf.place.begin ? &leaf : nullptr;  // quoted: its bytes are not found
  }
  std::string inside;
  if (!IsExpression(leaf.text, &inside)) return nullptr;
  const std::string name = OnlyName(inside);
  if (name.empty()) return nullptr;
  const FileNode* property = Find("//xacro:property[name=" + name + "]/@value");
  return property == nullptr ? nullptr : PlainNumber(*property);
}

}  // namespace trueline
