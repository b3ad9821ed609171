// Kernel sources to programs: what a file includes, where it is read from, and what is said of a file that does not compile.
#include <set>

#include "device/embedded_kernels.hpp"
#include "support/draw.hpp"
#include "support/scenes.hpp"

namespace halfshade {
namespace {

namespace fs = std::filesystem;

/// Sets HALFSHADE_KERNELS while it lives.
class KernelsFrom {
 public:
  explicit KernelsFrom(const fs::path& folder) {
    const char* variable = std::getenv("HALFSHADE_KERNELS");
    before_ = variable ? variable : "";  // an empty one is as good as none
    setenv("HALFSHADE_KERNELS", folder.c_str(), 1);
  }
  ~KernelsFrom() { setenv("HALFSHADE_KERNELS", before_.c_str(), 1); }
  KernelsFrom(const KernelsFrom&) = delete;
  KernelsFrom& operator=(const KernelsFrom&) = delete;

 private:
  std::string before_;
};

/// A copy of the kernels that one may break.
class KernelCopy {
 public:
  KernelCopy() {
    for (const EmbeddedKernel& kernel : embedded_kernels()) folder_.write(kernel.file, kernel.text);
  }
  fs::path path() const { return folder_ / ""; }
  /// Puts a line before number `line` (from 1) of a file.
  void insert(std::string_view file, int line, std::string_view text) const {
    std::string all;
    int number = 0;
    std::istringstream lines{std::string(text_of(file))};
    for (std::string one; std::getline(lines, one);) all += (++number == line ? std::string(text) + "\n" : "") + one + "\n";
    folder_.write(file, all);
  }
  void remove(std::string_view file) const { fs::remove(folder_ / file); }

  static std::string_view text_of(std::string_view file) {
    for (const EmbeddedKernel& kernel : embedded_kernels())
      if (kernel.file == file) return kernel.text;
    return {};
  }

 private:
  TempFolder folder_;
};

TEST(Programs, FilesIncludeOnlyWhatThereIs) {
  std::set<std::string_view> files;
  for (const EmbeddedKernel& kernel : embedded_kernels()) files.insert(kernel.file);
  EXPECT_GT(files.size(), 30u);
  std::size_t includes = 0;
  for (const EmbeddedKernel& kernel : embedded_kernels()) {
    const bool is_shared = kernel.file == "base/shared.h";  // hosts read it, too
    std::istringstream lines{std::string(kernel.text)};
    for (std::string line; std::getline(lines, line);) {
      const std::size_t at = line.find("#include");
      if (at == line.npos || (is_shared && line == "#include <CL/cl_platform.h>")) continue;
      const std::size_t open = line.find('"'), close = line.rfind('"');
      // The form that program.cpp resolves: from the beginning of a line, in quotes, from kernels/ on.
      EXPECT_TRUE(at == 0 && open == 9 && close == line.size() - 1 && close > open) << kernel.file << ": " << line;
      EXPECT_TRUE(files.contains(std::string_view(line).substr(open + 1, close - open - 1))) << kernel.file << ": " << line;
      EXPECT_FALSE(line.ends_with(".cl\"")) << kernel.file << ": " << line << ": kernels would be in two programs";
      ++includes;
    }
  }
  EXPECT_GT(includes, 30u);
}

TEST(Programs, AFileIsInASourceOnceWithItsOwnLineNumbers) {
  const std::string source = kernel_source("methods/exact/count_samples.cl");
  for (const std::string_view file : {"base/lanes.h", "base/shared.h", "base/view.h", "methods/exact/edge_block.h"}) {
    const std::string begin = "#line 1 \"kernels/" + std::string(file) + "\"";
    const std::size_t first = source.find(begin);
    ASSERT_NE(first, source.npos) << file;
    EXPECT_EQ(source.find(begin, first + 1), source.npos) << file;
  }
  EXPECT_EQ(source.find("#include \""), source.npos);
  EXPECT_EQ(source.find("#pragma once"), source.npos);
}

TEST(Programs, TheEmbeddedKernelsAreThoseOfTheFolder) {
  std::size_t count = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(HALFSHADE_KERNELS_DIR)) {
    if (entry.path().extension() != ".cl" && entry.path().extension() != ".h") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    EXPECT_EQ(KernelCopy::text_of(fs::relative(entry.path(), HALFSHADE_KERNELS_DIR).generic_string()), text.str())
        << entry.path();
    ++count;
  }
  EXPECT_EQ(count, embedded_kernels().size());
}

TEST(Programs, ACopyOfTheFolderDrawsTheSame) {
  const Watchdog watchdog;
  const KernelCopy copy;
  const Scene scene = box_over_floor();
  for (const Settings& settings : every_method()) {
    const Frame expected = draw_frame(test_device(), scene, settings);
    const KernelsFrom from(copy.path());
    EXPECT_EQ(draw_frame(Device::open(""), scene, settings).visibility, expected.visibility) << name_of(settings.method);
  }
}

TEST(Programs, WhatDoesNotCompileIsNamedByFileAndLine) {
  const Watchdog watchdog;
  // In a kernel's own file, and in one that it includes: the errors' lines are those of the files.
  for (const auto& [file, line] : {std::pair{"methods/pcf.cl", 7}, {"base/receiver.h", 120}}) {
    const KernelCopy copy;
    copy.insert(file, line, "this is not OpenCL C;");
    const KernelsFrom from(copy.path());
    const std::shared_ptr<Device> device = Device::open("");
    try {
      draw_frame(device, box_over_floor({16, 16}), {.method = Method::pcf, .light_resolution_px = 32});
      ADD_FAILURE() << "nothing was thrown";
    } catch (const DeviceError& error) {
      const std::string said = error.what();
      EXPECT_NE(said.find("do not compile"), said.npos) << said;
      EXPECT_NE(said.find(std::string("kernels/") + file + ":" + std::to_string(line)), said.npos) << said;
    }
  }
}

TEST(Programs, AFileThatIsMissingIsNamed) {
  const Watchdog watchdog;
  const KernelCopy copy;
  copy.remove("base/receiver.h");
  const KernelsFrom from(copy.path());
  expect_error<InputError>(
      [] {
        draw_frame(Device::open(""), box_over_floor({16, 16}), {.method = Method::hard, .light_resolution_px = 32});
      },
      {"base/receiver.h", "HALFSHADE_KERNELS", "unset it"});
}

}  // namespace
}  // namespace halfshade
