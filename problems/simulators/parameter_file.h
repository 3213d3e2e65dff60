// A parameter file of a simulator as a tree of texts with their places, whatever its format is. A
// number is known by its byte range, so that it can be replaced and all else stays as it is.
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <string>
#include <vector>

namespace trueline {

// Where a text stands in its file.
struct FilePlace {
  std::size_t begin = 0, end = 0;  // bytes
  int line = 0;                    // from 1
};

// A mapping, a list (children named 0, 1, ...), an XML element or a text. Attributes of an element
// are children named @NAME.
struct FileNode {
  std::string name;
  std::string text;  // of a leaf
  FilePlace place;   // of `text`
  std::vector<FileNode> children = {};

  const FileNode* Child(const std::string& child) const;
};

class ParameterFile {
 public:
  // YAML, TOML, XML (SDF, URDF, MJCF, xacro; also jinja whose templates stand in texts), a list of
  // PX4 parameters, known by the content, or the plain numbers of program code (.py, .cc, .hpp,
  // .java). Throws InputError with file, line and remedy.
  static ParameterFile Read(const std::filesystem::path& path);
  // The same of a text that is not on disk yet; `path` is for its format and messages.
  static ParameterFile Parse(const std::filesystem::path& path, std::string text);

  const std::filesystem::path& path() const { return path_; }
  const std::string& text() const { return text_; }
  const FileNode& root() const { return root_; }

  // The leaf or element at `where`, from `from` on; null if there is none.
  //   a/b/@c          child of a child, attribute
  //   a/2             of a list, or of a text of several numbers ("0 0 0.1")
  //   //plugin        at any depth
  //   link[name=x]    the first whose attribute or child `name` is the text x
  //   p|q             p, or else q
  const FileNode* Find(const std::string& where) const { return Find(root_, where); }
  const FileNode* Find(const FileNode& from, const std::string& where) const;
  // Elements named `name` at any depth, in the file's order.
  std::vector<const FileNode*> All(const std::string& name) const;

  // The number that `leaf` states; in xacro also what an expression such as ${a*b} gives. Throws
  // InputError for what is no number, naming file, line and remedy.
  double NumberOf(const FileNode& leaf) const;
  // Where to write the number of `leaf`: its own place, or that of the xacro property that it is
  // ("${mass}"). Null where it is computed.
  const FileNode* PlainNumber(const FileNode& leaf) const;

 private:
  ParameterFile(std::filesystem::path path, std::string text);
  double Evaluate(const FileNode& leaf, int depth) const;

  std::filesystem::path path_;
  std::string text_;
  FileNode root_;
  mutable std::deque<FileNode> tokens_;  // of texts of several numbers, made by Find
};

// The parsers of each format: `text` to a tree. Throw InputError.
FileNode ParseYamlFile(const std::filesystem::path& path, const std::string& text);
FileNode ParseTomlFile(const std::filesystem::path& path, const std::string& text);
FileNode ParseXmlFile(const std::filesystem::path& path, const std::string& text);
FileNode ParseCodeFile(const std::filesystem::path& path, const std::string& text);
FileNode ParsePx4File(const std::filesystem::path& path, const std::string& text);

// A text replaced by another, by byte ranges of the original.
struct FileEdit {
  FilePlace place;
  std::string text;
};
// `text` with all edits, which must not overlap.
std::string Edited(const std::string& text, std::vector<FileEdit> edits);

// The line (from 1) of a byte.
int LineOfByte(const std::string& text, std::size_t byte);

}  // namespace trueline
