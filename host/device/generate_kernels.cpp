// generate_kernels FOLDER OUTPUT.cpp OUTPUT.hpp
//
// Runs at build time. Reads the kernel sources in FOLDER and writes
//   OUTPUT.cpp  the files themselves, byte for byte, behind embedded_kernels() (device/embedded_kernels.hpp);
//   OUTPUT.hpp  one struct a kernel, with a member an argument, for launches by name (device/launcher.hpp).
//
// What it understands of OpenCL C is what the kernels use: `__kernel ... void name(arguments)`, arguments that are values or
// __global or __constant pointers, and macros HS_ARGS_NAME that stand for several arguments in a row and become structs of their
// own. Anything else is an error with file and line.
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace fs = std::filesystem;

namespace {

struct SourceFile {
  std::string name;  ///< relative to the folder, with /
  std::string text;
};

[[noreturn]] void fail(const SourceFile& file, std::size_t at, const std::string& message) {
  const auto line = 1 + std::count(file.text.begin(), file.text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  std::cerr << "kernels/" << file.name << ":" << line << ": " << message << "\n";
  std::exit(1);
}

/// An argument of a kernel, or a group of them.
struct Argument {
  std::string name;
  std::string type;  ///< of the C++ member
  bool is_group = false;
};

struct Kernel {
  std::string name, file;
  std::vector<Argument> arguments;
};

std::string trimmed(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const bool space = std::isspace(static_cast<unsigned char>(c)) != 0 || c == '\\';
    if (!space)
      result += c;
    else if (!result.empty() && result.back() != ' ')
      result += ' ';
  }
  if (!result.empty() && result.back() == ' ') result.pop_back();
  return result;
}

/// "count_samples" or "TRIANGLE_TILES" to "CountSamples", "TriangleTiles".
std::string upper_camel(std::string_view name) {
  std::string result;
  bool first = true;
  for (const char c : name) {
    if (c == '_') {
      first = true;
      continue;
    }
    result +=
        static_cast<char>(first ? std::toupper(static_cast<unsigned char>(c)) : std::tolower(static_cast<unsigned char>(c)));
    first = false;
  }
  return result;
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool is_identifier(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// The host's name of a type, "cl_float4" of "float4". Structs of base/shared.h keep theirs; structs that only kernels know are
/// collected in `opaque`.
std::string host_type(const std::string& type, std::set<std::string>& opaque) {
  static const std::set<std::string> scalars{"char", "uchar", "short", "ushort", "int",
                                             "uint", "long",  "ulong", "float",  "double"};
  const std::string base = type.substr(0, type.find_first_of("0123456789"));
  if (scalars.contains(base)) return "cl_" + type;
  if (!type.starts_with("Hs")) opaque.insert(type);
  return type;
}

Argument parse_argument(const SourceFile& file, std::size_t at, const std::string& text, std::set<std::string>& opaque) {
  constexpr std::string_view group = "HS_ARGS_";
  if (text.starts_with(group)) {
    const std::string name = text.substr(group.size());
    return {lower(name), upper_camel(name), true};
  }
  const bool pointer = text.find('*') != std::string::npos;
  std::string without_star = text;
  std::ranges::replace(without_star, '*', ' ');
  std::istringstream words(without_star);
  std::vector<std::string> all;
  for (std::string word; words >> word;) all.push_back(word);
  std::erase(all, "const");
  const bool global = !all.empty() && (all.front() == "__global" || all.front() == "__constant");
  if (global) all.erase(all.begin());
  if (all.size() != 2 || global != pointer)
    fail(file, at, "expected a kernel argument, a value or a __global or __constant pointer (found '" + text + "')");
  const std::string type = host_type(all[0], opaque);
  return {all[1], global ? "Global<" + type + ">" : "Value<" + type + ">", false};
}

std::vector<Argument> parse_arguments(const SourceFile& file, std::size_t at, const std::string& text,
                                      std::set<std::string>& opaque) {
  std::vector<Argument> arguments;
  std::istringstream in(text);
  for (std::string one; std::getline(in, one, ',');) arguments.push_back(parse_argument(file, at, trimmed(one), opaque));
  return arguments;
}

/// The text up to the parenthesis that closes the one before `begin`.
std::string to_closing_parenthesis(const SourceFile& file, std::size_t begin) {
  int depth = 1;
  for (std::size_t i = begin; i < file.text.size(); ++i) {
    depth += file.text[i] == '(' ? 1 : file.text[i] == ')' ? -1 : 0;
    if (depth == 0) return file.text.substr(begin, i - begin);
  }
  fail(file, begin, "expected a closing parenthesis");
}

void find_kernels(const SourceFile& file, std::vector<Kernel>& kernels, std::set<std::string>& opaque) {
  constexpr std::string_view keyword = "__kernel";
  for (std::size_t at = file.text.find(keyword); at != std::string::npos; at = file.text.find(keyword, at + 1)) {
    if (file.text.rfind("//", at) != std::string::npos && file.text.find('\n', file.text.rfind("//", at)) > at)
      continue;  // in a comment
    const std::size_t returns = file.text.find("void ", at), name = returns + 5, open = file.text.find('(', name);
    if (returns == std::string::npos || open == std::string::npos) fail(file, at, "expected '__kernel ... void name('");
    Kernel kernel{trimmed(file.text.substr(name, open - name)), file.name, {}};
    if (kernel.name.empty() || !std::ranges::all_of(kernel.name, is_identifier)) fail(file, name, "expected the kernel's name");
    if (!file.name.ends_with(".cl"))
      fail(file, at, "expected kernels in .cl files only; what .h files hold may be included twice");
    kernel.arguments = parse_arguments(file, open, to_closing_parenthesis(file, open + 1), opaque);
    kernels.push_back(std::move(kernel));
  }
}

void find_groups(const SourceFile& file, std::map<std::string, std::vector<Argument>>& groups, std::set<std::string>& opaque) {
  constexpr std::string_view keyword = "#define HS_ARGS_";
  for (std::size_t at = file.text.find(keyword); at != std::string::npos; at = file.text.find(keyword, at + 1)) {
    std::size_t name_end = at + keyword.size();
    while (is_identifier(file.text[name_end])) ++name_end;
    std::size_t end = name_end;
    while (end < file.text.size() && !(file.text[end] == '\n' && file.text[end - 1] != '\\')) ++end;
    const std::string name = file.text.substr(at + keyword.size(), name_end - at - keyword.size());
    groups[upper_camel(name)] = parse_arguments(file, at, file.text.substr(name_end, end - name_end), opaque);
  }
}

std::string struct_text(const std::string& name, const std::vector<Argument>& arguments, const std::string& head) {
  std::string text = "struct " + name + " {\n" + head;
  for (const Argument& argument : arguments)
    text += "  " + (argument.is_group ? "args::" + argument.type : argument.type) + " " + argument.name + ";\n";
  text += "  template <class Visit>\n  void for_each_argument(Visit&& visit) const {\n";
  for (const Argument& argument : arguments)
    text += "    " + (argument.is_group ? argument.name + ".for_each_argument(visit)" : "visit(" + argument.name + ")") + ";\n";
  return text + "  }\n};\n";
}

std::string header_text(const std::vector<Kernel>& kernels, const std::map<std::string, std::vector<Argument>>& groups,
                        const std::set<std::string>& opaque) {
  std::string text =
      "// Made by host/device/generate_kernels.cpp from the kernels' signatures; changes are lost.\n#pragma once\n\n"
      "#include \"device/kernel_arguments.hpp\"\n\nnamespace halfshade::kernels {\n\n";
  for (const std::string& type : opaque) text += "struct " + type + ";  // only kernels know it\n";
  text += "\nnamespace args {\n\n";
  for (const auto& [name, arguments] : groups) text += struct_text(name, arguments, "") + "\n";
  text += "}  // namespace args\n\n";
  for (const Kernel& kernel : kernels)
    text += struct_text(upper_camel(kernel.name), kernel.arguments,
                        "  static constexpr KernelName kernel{\"" + kernel.name + "\", \"" + kernel.file + "\"};\n") +
            "\n";
  return text + "}  // namespace halfshade::kernels\n";
}

std::string source_text(const std::vector<SourceFile>& files) {
  std::string arrays, entries;
  for (std::size_t i = 0; i < files.size(); ++i) {
    // Bytes rather than string literals: any content survives, and no compiler limit on a literal's length applies. The closing 0
    // keeps an empty file's array legal; it is not part of the text.
    arrays += "const unsigned char bytes_" + std::to_string(i) + "[] = {";
    for (std::size_t k = 0; k < files[i].text.size(); ++k) {
      if (k % 32 == 0) arrays += '\n';
      arrays += std::to_string(static_cast<unsigned char>(files[i].text[k])) + ",";
    }
    arrays += "0};\n";
    entries += "      {\"" + files[i].name + "\", text_of(bytes_" + std::to_string(i) + ", sizeof(bytes_" + std::to_string(i) +
               ") - 1)},\n";
  }
  return "// Made by host/device/generate_kernels.cpp; changes are lost.\n#include \"device/embedded_kernels.hpp\"\n\n"
         "#include <array>\n#include <cstddef>\n\nnamespace halfshade {\nnamespace {\n\n" +
         arrays +
         "\nstd::string_view text_of(const unsigned char* bytes, std::size_t size) {\n"
         "  return {reinterpret_cast<const char*>(bytes), size};\n}\n\n}  // namespace\n\n"
         "std::span<const EmbeddedKernel> embedded_kernels() {\n  static const std::array<EmbeddedKernel, " +
         std::to_string(files.size()) + "> files{{\n" + entries + "  }};\n  return files;\n}\n\n}  // namespace halfshade\n";
}

std::vector<SourceFile> read_sources(const fs::path& folder) {
  std::vector<SourceFile> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path& path = entry.path();
    if (path.extension() != ".cl" && path.extension() != ".h") continue;
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    if (!(text << in.rdbuf())) {
      std::cerr << path.string() << ": cannot be read\n";
      std::exit(1);
    }
    files.push_back({fs::relative(path, folder).generic_string(), text.str()});
  }
  std::ranges::sort(files, {}, &SourceFile::name);
  return files;
}

/// Only where the text is new, so that what does not depend on a change is not built again.
void write_if_changed(const char* path, const std::string& text) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream before;
  before << in.rdbuf();
  if (in && before.str() == text) return;
  std::ofstream out(path, std::ios::binary);
  if (!(out << text).flush()) {
    std::cerr << path << ": cannot be written\n";
    std::exit(1);
  }
}

}  // namespace

int main(int argument_count, char** arguments) {
  if (argument_count != 4) {
    std::cerr << "usage: generate_kernels FOLDER OUTPUT.cpp OUTPUT.hpp\n";
    return 2;
  }
  const std::vector<SourceFile> files = read_sources(arguments[1]);
  std::vector<Kernel> kernels;
  std::map<std::string, std::vector<Argument>> groups;
  std::set<std::string> opaque;
  for (const SourceFile& file : files) {
    find_groups(file, groups, opaque);
    find_kernels(file, kernels, opaque);
  }
  for (const Kernel& kernel : kernels)
    for (const Argument& argument : kernel.arguments)
      if (argument.is_group && !groups.contains(argument.type)) {
        std::cerr << "kernels/" << kernel.file << ": kernel " << kernel.name << ": HS_ARGS_" << argument.type
                  << " is not defined anywhere\n";
        return 1;
      }
  write_if_changed(arguments[2], source_text(files));
  write_if_changed(arguments[3], header_text(kernels, groups, opaque));
}
