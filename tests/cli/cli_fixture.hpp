// The program run as its users run it, in a folder of the test's own.
#pragma once

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace halfshade {

namespace fs = std::filesystem;

/// What a run of the program left.
struct Result {
  int code = -1;
  std::string out, err;
};

inline std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

inline bool has(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

/// A test that runs the program.
class Cli : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "halfshade-cli-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    fs::copy_file(fs::path(HALFSHADE_DATA_DIR) / "meshes" / "box.obj", folder_ / "box.obj");
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Where a run's stdout or stderr goes.
  enum class Stream { kept, full, closed, broken_pipe };

  /// Makes a stream of this process what it is to be. Returns whether that worked.
  static bool set_stream(int descriptor, Stream stream, const char* file) {
    if (stream == Stream::closed) return close(descriptor) == 0;
    if (stream == Stream::broken_pipe) {
      int ends[2];
      return pipe(ends) == 0 && close(ends[0]) == 0 && dup2(ends[1], descriptor) >= 0 && close(ends[1]) == 0;
    }
    const int opened = stream == Stream::full ? open("/dev/full", O_WRONLY) : open(file, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    return opened >= 0 && dup2(opened, descriptor) >= 0 && (opened == descriptor || close(opened) == 0);
  }

  /// Runs the program in the test's folder. `file_limit` is the largest file it may write, as on a full disk.
  Result run(std::vector<std::string> arguments, std::optional<rlim_t> file_limit = {}, Stream out_stream = Stream::kept,
             Stream err_stream = Stream::kept) {
    arguments.insert(arguments.begin(), HALFSHADE_CLI);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    const std::string out = folder_.string() + ".out", err = folder_.string() + ".err", working_folder = folder_.string();
    const pid_t child = fork();
    if (child == 0) {
      if (chdir(working_folder.c_str()) != 0 || !set_stream(1, out_stream, out.c_str()) ||
          !set_stream(2, err_stream, err.c_str()))
        _exit(126);
      if (file_limit) {
        const rlimit limit{*file_limit, *file_limit};
        setrlimit(RLIMIT_FSIZE, &limit);
      }
      execv(pointers[0], pointers.data());
      _exit(127);
    }
    int status = 0;
    waitpid(child, &status, 0);
    Result result{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_text(out), read_text(err)};
    fs::remove(out);
    fs::remove(err);
    return result;
  }

  /// One line on stderr with all `parts`, the code, nothing on stdout, and no file made in the output folder.
  void expect_failure(const std::vector<std::string>& arguments, const std::vector<std::string>& parts, int code = 2) {
    const Result result = run(arguments);
    SCOPED_TRACE(fmt::format("{}: {}", fmt::join(arguments, " "), result.err));
    EXPECT_EQ(result.code, code);
    EXPECT_EQ(result.out, "");
    EXPECT_TRUE(result.err.starts_with("halfshade: "));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
    for (const std::string& part : parts) EXPECT_TRUE(has(result.err, part)) << "missing: " << part;
    EXPECT_EQ(files_in("out"), std::vector<std::string>{});
  }

  std::vector<std::string> files_in(const std::string& name) const {
    std::vector<std::string> names;
    if (fs::is_directory(folder_ / name)) {
      for (const auto& entry : fs::directory_iterator(folder_ / name)) names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }

  /// A scene file, changed by `change`.
  template <typename Change>
  std::string scene(Change change, const std::string& name = "scene.json") const {
    auto json = nlohmann::json::parse(R"({
      "meshes": [{"name": "box", "path": "box.obj"}],
      "camera": {"position": [3, 4, 5], "target": [0, 0, 0], "resolution": [37, 21]},
      "lights": [{"name": "key", "type": "spot", "position": [1, 5, 2], "target": [0, 0, 0], "radius": 0.2}]})");
    change(json);
    write(name, json.dump());
    return name;
  }
  std::string scene() const {
    return scene([](nlohmann::json&) {});
  }

  fs::path folder_;
};

}  // namespace halfshade
