// The folder of compiled kernels: whose it is, and what it survives. Each run is a process of its own, for PoCL reads its
// variables once.
#include "device/kernel_cache.hpp"

#include <sys/stat.h>

#include "cli/cli_fixture.hpp"

namespace halfshade {
namespace {

/// An environment variable for as long as this lives; null: unset.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    set(value);
  }
  ~Variable() { set(before_ ? before_->c_str() : nullptr); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  void set(const char* value) {
    if (value != nullptr)
      setenv(name_, value, 1);
    else
      unsetenv(name_);
  }
  const char* name_;
  std::optional<std::string> before_;
};

class KernelCache : public Cli {
 protected:
  void SetUp() override {
    Cli::SetUp();
    cache_ = folder_ / "pocl";
  }
  Result draw() { return run({"render", scene(), "-m", "hard", "-o", "out"}); }
  static unsigned mode_of(const fs::path& path) {
    struct stat status {};
    EXPECT_EQ(stat(path.c_str(), &status), 0) << path;
    return status.st_mode & 0777;
  }
  /// Files of compiled kernels and programs.
  std::vector<fs::path> compiled(const fs::path& folder) const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.path().extension() == ".so" || entry.path().extension() == ".bc") files.push_back(entry.path());
    return files;
  }

  fs::path cache_;
};

TEST_F(KernelCache, IsOfTheUserAloneWhereTheVariableIsUnsetOrEmpty) {
  for (const char* value : {static_cast<const char*>(nullptr), ""}) {
    fs::remove_all(folder_ / "home");
    const Variable unset("POCL_CACHE_DIR", value), home("XDG_CACHE_HOME", (folder_ / "home").c_str());
    const Result result = draw();
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_EQ(mode_of(folder_ / "home" / "halfshade" / "pocl"), 0700u);
    EXPECT_FALSE(compiled(folder_ / "home" / "halfshade" / "pocl").empty());
  }
}

TEST_F(KernelCache, IsMadeAndClosedToOthersWhereTheVariableSays) {
  const Variable chosen("POCL_CACHE_DIR", (cache_ / "deep").c_str());
  EXPECT_EQ(run({"devices"}).code, 0);
  EXPECT_EQ(mode_of(cache_ / "deep"), 0700u);
  fs::permissions(cache_ / "deep", fs::perms::all);
  EXPECT_EQ(run({"devices"}).code, 0);
  EXPECT_EQ(mode_of(cache_ / "deep"), 0700u);
}

TEST_F(KernelCache, ThatCannotBeMadeIsNamed) {
  write("file", "not a folder");
  for (const std::string& path :
       {(folder_ / "file").string(), (folder_ / "file" / "below").string(), std::string("/proc/none")}) {
    const Variable chosen("POCL_CACHE_DIR", path.c_str());
    expect_failure({"devices"}, {"POCL_CACHE_DIR", path, "unset it"});
  }
}

TEST_F(KernelCache, IsCompiledAnewWhereFilesHaveBeenCutShortOrEmptied) {
  const Variable chosen("POCL_CACHE_DIR", cache_.c_str());
  ASSERT_EQ(draw().code, 0);
  const std::string expected = read_text(folder_ / "out" / "scene.hard.0001.exr");
  const std::vector<fs::path> files = compiled(cache_);
  ASSERT_GT(files.size(), 10u);
  for (const double part : {0.0, 0.1, 0.5, 0.99}) {
    for (const fs::path& file : compiled(cache_))
      fs::resize_file(file, static_cast<std::uintmax_t>(part * static_cast<double>(fs::file_size(file))));
    const Result result = draw();
    EXPECT_EQ(result.code, 0) << part << ": " << result.err;
    EXPECT_EQ(read_text(folder_ / "out" / "scene.hard.0001.exr").size(), expected.size());
  }
  // What is whole stays.
  const auto written = fs::last_write_time(files.front());
  remove_damaged_entries(cache_);
  ASSERT_TRUE(fs::exists(files.front()));
  EXPECT_EQ(fs::last_write_time(files.front()), written);
}

}  // namespace
}  // namespace halfshade
