// The program as its users meet it: what it prints, what it leaves on the disk, and how it fails.
#include "cli/cli_fixture.hpp"

#include <cmath>
#include <csignal>
#include <limits>

#include "halfshade/halfshade.hpp"
#include "image/image_io.hpp"

namespace halfshade {
namespace {

// ------------------------------------------------------------------------------------------------------------- what it says

TEST_F(Cli, RenderSaysWhatAFrameWasMadeOf) {
  const std::string name = scene([](nlohmann::json& json) {
    json["meshes"].push_back({{"name", "low"}, {"path", "box.obj"}, {"translation", {0, -3, 0}}, {"scale", {9, 1, 9}}});
  });
  const Result result = run({"render", name, "-q", "--stats", "-m", "hard,smoothies,exact"});
  EXPECT_EQ(result.code, 0) << result.err;
  std::istringstream lines(result.out);
  std::string frame, light;
  for (const std::string method : {"hard", "smoothies", "exact"}) {
    SCOPED_TRACE(result.out);
    ASSERT_TRUE(std::getline(lines, frame) && std::getline(lines, light));
    EXPECT_EQ(frame, "scene." + method + ".0001: 24 triangles, 16 vertices, 36 edges");
    EXPECT_TRUE(light.starts_with("  key: light map "));
    EXPECT_EQ(has(light, "silhouette edges"), method != "hard");
    EXPECT_EQ(has(light, " fins, "), method == "smoothies");
    EXPECT_EQ(has(light, ", 0 pixels with negative depth complexity"), method == "exact");
  }
  EXPECT_FALSE(std::getline(lines, frame));
  EXPECT_EQ(run({"render", name, "-q"}).out, "");
}

TEST_F(Cli, RenderSaysWhereNothingCasts) {
  const std::string name = scene([](nlohmann::json& json) { json["meshes"][0]["casts_shadow"] = false; });
  EXPECT_TRUE(has(run({"render", name, "-q", "--stats"}).out, "  key: nothing casts a shadow in its reach\n"));
}

TEST_F(Cli, HelpFitsAScreenAndShowsExamples) {
  for (const std::string command : {"", "render", "bench", "compare", "report", "inspect", "devices", "methods"}) {
    const Result result = command.empty() ? run({"--help"}) : run({command, "--help"});
    SCOPED_TRACE(command);
    EXPECT_EQ(result.code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_TRUE(has(result.out, "\n  halfshade " + command)) << result.out;
    std::istringstream lines(result.out);
    std::size_t count = 0, widest = 0;
    for (std::string line; std::getline(lines, line); ++count) widest = std::max(widest, line.size());
    // What methods declare comes on top: up to a few lines an option.
    const bool has_method_options = command == "render" || command == "bench";
    EXPECT_LE(count, 40u + (has_method_options ? 12u : 0u));
    EXPECT_LE(widest, 105u);
  }
}

TEST_F(Cli, WithoutArgumentsItHelpsAndFails) {
  const Result result = run({});
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_TRUE(has(result.err, "Usage:"));
}

TEST_F(Cli, Version) {
  EXPECT_EQ(run({"--version"}).out, "halfshade " HALFSHADE_VERSION "\n");
}

TEST_F(Cli, MethodsListsAll) {
  const Result result = run({"methods"});
  EXPECT_EQ(result.code, 0);
  for (const MethodInfo& info : methods()) {
    for (const std::string_view text : {info.name, info.summary, info.source, info.exact_when, info.receivers, info.time})
      EXPECT_TRUE(has(result.out, text)) << text;
  }
}

TEST_F(Cli, DevicesListsAll) {
  const Result result = run({"devices"});
  EXPECT_EQ(result.code, 0);
  const auto json = nlohmann::json::parse(run({"devices", "--json"}).out);
  const std::vector<DeviceInfo> devices = list_devices();
  ASSERT_EQ(json.size(), devices.size());
  for (const DeviceInfo& info : devices) {
    EXPECT_TRUE(has(result.out, info.name)) << result.out;
    EXPECT_EQ(json.at(info.index).at("name"), info.name);
    EXPECT_EQ(json.at(info.index).at("selector"), fmt::format("{}:{}", info.platform, info.device));
    EXPECT_EQ(json.at(info.index).at("kernel_shape"), info.has_wide_kernels ? "wide" : "narrow");
  }
}

TEST_F(Cli, InspectPrintsTextAndJson) {
  EXPECT_TRUE(has(run({"inspect", "box.obj"}).out, "box.obj"));
  const auto json = nlohmann::json::parse(run({"inspect", "--json", "box.obj", "box.obj"}).out);
  EXPECT_EQ(json.size(), 2u);
}

// ------------------------------------------------------------------------------------------------------------- what it makes

TEST_F(Cli, AnOutputFolderThatCannotBeMadeIsRefusedBeforeTheWork) {
  write("file", "");
  for (const std::string command : {"render", "report"}) {
    expect_failure({command, scene(), "-o", "file"}, {"file: expected an output folder", "a file is there"});
    expect_failure({command, scene(), "-o", "file/deeper"}, {"file/deeper: expected an output folder", "Not a directory"});
    expect_failure({command, scene(), "-o", std::string(300, 'a')}, {"expected an output folder", "File name too long"});
  }
}

TEST_F(Cli, RenderWritesOneFrameAMethod) {
  const Result result = run({"render", scene(), "--method", "all", "-o", "out/deep"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  std::vector<std::string> expected;
  for (const MethodInfo& info : methods()) expected.push_back(fmt::format("scene.{}.0001.exr", info.name));
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(files_in("out/deep"), expected);
  // Piped: a line a picture.
  EXPECT_EQ(static_cast<std::size_t>(std::count(result.err.begin(), result.err.end(), '\n')), methods().size());
  EXPECT_FALSE(has(result.err, "\x1b"));
}

TEST_F(Cli, RenderDrawsWithTheLibrarysDefaultMethod) {
  ASSERT_EQ(run({"render", scene()}).code, 0);
  EXPECT_EQ(files_in("out"), (std::vector<std::string>{fmt::format("scene.{}.0001.exr", name_of(Settings{}.method))}));
  EXPECT_TRUE(has(run({"render", "--help"}).out, fmt::format("(default: {})", name_of(Settings{}.method))));
}

TEST_F(Cli, RenderWritesWhatIsAsked) {
  const Result result = run({"render",       scene(), "-q",          "-m", "smoothies", "--png", "--light-buffers",  "--half",
                             "--resolution", "5x3",   "--light-res", "64", "--falloff", "disc",  "--smoothie-width", "0.05",
                             "--device",     "0",     "--threads",   "1"});
  EXPECT_EQ(result.code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(files_in("out"),
            (std::vector<std::string>{"scene.smoothies.0001.exr", "scene.smoothies.0001.key.exr", "scene.smoothies.0001.png"}));
  const ExrImage image = read_exr(folder_ / "out/scene.smoothies.0001.exr");
  EXPECT_EQ(image.resolution, glm::uvec2(5, 3));
  for (const char* name : {"R", "G", "B", "shadow_key.Y", "P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z", "depth.Z"}) {
    EXPECT_TRUE(image.channels.contains(name)) << name;
  }
  EXPECT_EQ(image.metadata.at("method"), "smoothies");
  EXPECT_EQ(image.metadata.at("falloff"), "disc");
  EXPECT_EQ(image.metadata.at("smoothie_width"), "0.05");
  EXPECT_EQ(image.metadata.at("light_resolution_px"), "64");
  EXPECT_EQ(image.metadata.at("version"), HALFSHADE_VERSION);
  for (const char* name : {"device", "time", "render_ms", "scene", "frame"}) EXPECT_TRUE(image.metadata.contains(name)) << name;
  EXPECT_TRUE(read_exr(folder_ / "out/scene.smoothies.0001.key.exr").channels.contains("shadow_map.Z"));
}

TEST_F(Cli, RenderDrawsTheFramesAsked) {
  const std::string animated = scene([](nlohmann::json& json) {
    json["animation"] = {{"frames", {3, 5}},
                         {"tracks", {{{"target", "box.translation"}, {"keys", {{3, {0, 0, 0}}, {5, {2, 0, 0}}}}}}}};
  });
  ASSERT_EQ(run({"render", animated, "-m", "hard"}).code, 0);
  EXPECT_EQ(files_in("out"), (std::vector<std::string>{"scene.hard.0003.exr", "scene.hard.0004.exr", "scene.hard.0005.exr"}));
  ASSERT_EQ(run({"render", animated, "-m", "hard", "--frames", "5", "-o", "one"}).code, 0);
  EXPECT_EQ(files_in("one"), (std::vector<std::string>{"scene.hard.0005.exr"}));
  EXPECT_EQ(read_exr(folder_ / "one/scene.hard.0005.exr").channels, read_exr(folder_ / "out/scene.hard.0005.exr").channels);
  EXPECT_NE(read_exr(folder_ / "out/scene.hard.0003.exr").channels, read_exr(folder_ / "out/scene.hard.0005.exr").channels);
}

TEST_F(Cli, UnusualScenesAreValid) {
  scene([](nlohmann::json& json) { json["meshes"] = nlohmann::json::array(); }, "empty.json");
  scene([](nlohmann::json& json) { json["lights"] = nlohmann::json::array(); }, "dark.json");
  scene([](nlohmann::json& json) { json["camera"]["position"] = {0.01, 0.02, 0.03}; }, "inside.json");
  scene([](nlohmann::json& json) { json["camera"]["resolution"] = {1, 1}; }, "pixel.json");
  for (const char* name : {"empty.json", "dark.json", "inside.json", "pixel.json"}) {
    const Result result = run({"render", name, "-m", "all", "--png", "--light-buffers"});
    EXPECT_EQ(result.code, 0) << name << result.err;
    const std::string stem = fs::path(name).stem().string();
    EXPECT_TRUE(fs::exists(folder_ / "out" / (stem + ".smoothies.0001.exr"))) << name;
  }
}

TEST_F(Cli, BenchPrintsATableAndJson) {
  const Result table = run({"bench", scene(), "--repeat", "2"});
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_TRUE(has(table.out, "median ms"));
  const Result result = run({"bench", scene(), "--repeat", "2", "-m", "hard,smoothies", "--json"});
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("repeat"), 2);
  ASSERT_EQ(json.at("methods").size(), 2u);
  for (const auto& method : json.at("methods")) {
    EXPECT_FALSE(method.at("stages_ms").empty());
    EXPECT_LE(method.at("frame_ms").at("min"), method.at("frame_ms").at("median"));
    EXPECT_GT(method.at("lights").at(0).at("visibility_ms").at("min"), 0.0);
  }
}

// -------------------------------------------------------------------------------------------------------------- how it fails

TEST_F(Cli, WrongUsage) {
  expect_failure({"paint"}, {"paint", "halfshade --help"});
  expect_failure({"render"}, {"SCENE", "halfshade render --help"});
  expect_failure({"render", scene(), "--sharp"}, {"--sharp", "halfshade render --help"});
  expect_failure({"render", scene(), "-m", "magic"}, {"magic", "smoothies"});
  expect_failure({"render", scene(), "--device", "nothing like it"}, {"nothing like it"});
  expect_failure({"render", scene(), "--device", "99"}, {"99"});
  expect_failure({"render", scene(), "--frames", "5-1"}, {"--frames", "5-1"});
  expect_failure({"render", scene(), "--frames", "x"}, {"--frames", "x"});
  expect_failure({"render", scene(), "--threads", "-3"}, {"--threads", "-3"});
  expect_failure({"render", scene(), "-m", "fins", "--falloff", "steep"}, {"--falloff", "steep", "bernstein"});
  expect_failure({"render", scene(), "-m", "smoothies", "--smoothie-width", "-1"}, {"--smoothie-width", "-1", "auto"});
  expect_failure({"render", scene(), "-m", "smoothies", "--smoothie-width", "nan"}, {"--smoothie-width", "nan"});
  expect_failure({"render", scene(), "-m", "pcf", "--pcf-filter", "3"}, {"--pcf-filter", "3"});
  expect_failure({"render", scene(), "-m", "pcss", "--pcss-taps", "64"}, {"--pcss-taps", "16 or 32", "64"});
  expect_failure({"render", scene(), "--light-res", "0"}, {"--light-res", "0"});
  expect_failure({"bench", scene(), "--repeat", "0"}, {"--repeat", "0"});
  expect_failure({"inspect"}, {"MESH", "halfshade inspect --help"});
}

TEST_F(Cli, AnOptionThatNoMethodUsesIsAnError) {
  expect_failure({"render", scene(), "-m", "hard", "--falloff", "sine"}, {"--falloff", "hard", "smoothies"});
  expect_failure({"render", scene(), "-m", "fins", "--layers", "4"}, {"--layers", "fins", "layered-fins"});
  expect_failure({"render", scene(), "-m", "layered-fins", "--layers", "1025"}, {"--layers", "1024", "1025"});
  expect_failure({"render", scene(), "-m", "light-samples", "--samples", "0"}, {"--samples", "0"});
  // A method is named where others take the value.
  expect_failure({"render", scene(), "-m", "light-samples,exact", "--samples", "99"}, {"--samples: method exact: ", "16", "99"});
  expect_failure({"render", scene(), "-m", "pcf", "--faithful"}, {"--faithful", "pcf", "smoothies"});
  expect_failure({"render", scene(), "-m", "hard,pcf", "--smoothie-width", "auto"},
                 {"--smoothie-width", "hard, pcf", "smoothies"});
  expect_failure({"bench", scene(), "-m", "smoothies", "--pcf-filter", "4"}, {"--pcf-filter", "smoothies", "pcf"});
  expect_failure({"render", scene(), "-m", "pcf", "--pcss-taps", "16"}, {"--pcss-taps", "pcf", "pcss"});
  EXPECT_EQ(run({"render", scene(), "-m", "hard,pcf", "--pcf-filter", "4"}).code, 0);
  EXPECT_EQ(run({"render", scene(), "-m", "pcss", "--pcss-taps", "16"}).code, 0);
}

TEST_F(Cli, ResolutionsOutOfRange) {
  expect_failure({"render", scene(), "--resolution", "0x64"}, {"--resolution", "0"});
  expect_failure({"render", scene(), "--resolution", "64"}, {"--resolution", "64"});
  expect_failure({"render", scene(), "--resolution", "99999999x1"}, {"--resolution", "99999999"});
  expect_failure({"render", scene(), "--resolution", "65536x65536"}, {"--resolution", "65536", "16384"});
  expect_failure({"render", scene([](nlohmann::json& json) {
                    json["camera"]["resolution"] = {0, 64};
                  })},
                 {"scene.json", "camera.resolution"});
}

TEST_F(Cli, ScenesThatCannotBeRead) {
  expect_failure({"render", "missing.json"}, {"missing.json", "no such file"});
  expect_failure({"render", "."}, {"folder"});
  write("broken.json", "{\"meshes\": [");
  expect_failure({"render", "broken.json"}, {"broken.json"});
  write("nothing.json", "");
  expect_failure({"render", "nothing.json"}, {"nothing.json"});
  expect_failure({"render", scene([](nlohmann::json& json) { json["camera"]["zoom"] = 2; })}, {"scene.json", "camera", "zoom"});
  expect_failure({"render", scene([](nlohmann::json& json) { json["lights"][0]["radius"] = "wide"; })},
                 {"scene.json", "lights[0].radius", "number"});
  expect_failure({"render", scene([](nlohmann::json& json) { json["meshes"][0]["path"] = "gone.obj"; })}, {"gone.obj"});
  expect_failure({"render", scene([](nlohmann::json& json) { json["camera"]["yfov_deg"] = 1e300 * 10; })},
                 {"scene.json", "yfov_deg"});
  if (geteuid() != 0) {
    fs::permissions(folder_ / scene(), fs::perms::none);
    expect_failure({"render", "scene.json"}, {"scene.json"});
  }
}

TEST_F(Cli, MeshesThatCannotBeRead) {
  const std::string with_mesh = scene([](nlohmann::json& json) { json["meshes"][0]["path"] = "mesh.obj"; });
  for (const auto& [text, part] : {std::pair<std::string, std::string>{"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "9"},
                                   {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9\n", "-9"},
                                   {"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "nan"},
                                   {"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "face"},
                                   {"", "empty"}}) {
    write("mesh.obj", text);
    expect_failure({"render", with_mesh}, {"mesh.obj", part});
    expect_failure({"inspect", "mesh.obj"}, {"mesh.obj", part});
  }
  expect_failure({"inspect", "none.obj"}, {"none.obj"});
}

TEST_F(Cli, OutputFoldersThatCannotBeUsed) {
  write("file", "x");
  expect_failure({"render", scene(), "-o", "file"}, {"file", "folder", "-o"});
  expect_failure({"render", scene(), "-o", "file/below"}, {"file/below", "folder", "-o"});
  expect_failure({"render", scene(), "-o", "/proc/halfshade"}, {"/proc/halfshade", "folder", "-o"});
  if (geteuid() != 0) {
    fs::create_directory(folder_ / "locked");
    fs::permissions(folder_ / "locked", fs::perms::owner_read | fs::perms::owner_exec);
    expect_failure({"render", scene(), "-o", "locked"}, {"locked", "folder", "-o"});
  }
}

TEST_F(Cli, AFullDiskIsNoticedAndLeavesNothing) {
  // The limit is on every file that the process writes; it leaves room for the OpenCL compiler's, not for the frame.
  const Result result = run({"render", HALFSHADE_DATA_DIR "/scenes/primitives.json", "-m", "hard"}, 4 << 20);
  EXPECT_EQ(result.code, 1) << result.err;
  EXPECT_TRUE(has(result.err, "out/primitives.hard.0001.exr")) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_EQ(files_in("out"), std::vector<std::string>{});
}

TEST_F(Cli, NoRenderFailsBecauseNobodyReadsItsMessages) {
  const std::string file = scene([](nlohmann::json& json) { json["animation"] = {{"frames", {1, 3}}}; });
  for (const Stream err : {Stream::full, Stream::closed, Stream::broken_pipe}) {
    const Result result = run({"render", file, "-m", "hard"}, {}, Stream::kept, err);
    EXPECT_EQ(result.code, 0) << static_cast<int>(err);
    const std::vector<std::string> files = files_in("out");
    ASSERT_EQ(files.size(), 3u);
    for (const std::string& name : files) EXPECT_NO_THROW(read_exr(folder_ / "out" / name));
    fs::remove_all(folder_ / "out");
    EXPECT_EQ(run({"render", "none.json"}, {}, Stream::kept, err).code, 2);
  }
  EXPECT_EQ(run({"render", file, "-m", "hard"}, {}, Stream::closed, Stream::closed).code, 0) << "it prints no results";
}

TEST_F(Cli, ResultsThatCannotBePrintedAreAFailure) {
  for (const Stream out : {Stream::full, Stream::closed, Stream::broken_pipe}) {
    const std::vector<std::vector<std::string>> commands = {
        {"inspect", "box.obj"}, {"inspect", "--json", "box.obj"}, {"methods"}, {"methods", "--json"}, {"--help"}, {"--version"}};
    for (const std::vector<std::string>& command : commands) {
      const Result result = run(command, {}, out);
      EXPECT_EQ(result.code, 1) << fmt::format("{}", fmt::join(command, " ")) << result.err;
      EXPECT_TRUE(has(result.err, "stdout")) << result.err;
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
  }
}

TEST_F(Cli, WhatKilledRendersLeftIsRemoved) {
  const std::string dead = "4194303", file = scene();  // beyond any process number of a default Linux
  fs::create_directory(folder_ / "out");
  const auto part = [&](const std::string& name) { return "out/." + name + "." + dead + ".0.part"; };
  const std::vector<std::string> stale{part("scene.hard.0001.exr"), part("scene.hard.0001.png"), part("scene.hard.0001.key.exr")};
  const std::vector<std::string> kept{part("scene.hard.0002.exr"), part("scene.pcf.0001.exr"), part("other.hard.0001.exr"),
                                      part("scene.hard.1.exr"), part("scene.hard.0001.rim.exr")};
  for (const auto& names : {stale, kept})
    for (const std::string& name : names) write(name, "x");
  ASSERT_EQ(run({"render", file, "-m", "hard", "--png", "--light-buffers", "-q"}).code, 0);
  for (const std::string& name : stale) EXPECT_FALSE(fs::exists(folder_ / name)) << name;
  for (const std::string& name : kept) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
}

TEST_F(Cli, PathsOutsideOfTheScenesFolderNeedAFlag) {
  fs::create_directory(folder_ / "inside");
  const std::string file = scene([](nlohmann::json& json) { json["meshes"][0]["path"] = "../box.obj"; }, "inside/scene.json");
  expect_failure({"render", file, "-m", "hard"}, {"inside/scene.json: meshes[0].path: ", "../box.obj", "--allow-outside"});
  expect_failure({"bench", file, "-m", "hard"}, {"--allow-outside"});
  EXPECT_EQ(run({"render", file, "-m", "hard", "--allow-outside"}).code, 0);
  EXPECT_EQ(files_in("out").size(), 1u);
}

TEST_F(Cli, NamesThatAreTooLongAreRefusedBeforeAnythingIsDrawn) {
  const auto with_light = [&](std::size_t length, const std::string& name = "scene.json") {
    return scene([&](nlohmann::json& json) { json["lights"][0]["name"] = std::string(length, 'k'); }, name);
  };
  expect_failure({"render", with_light(400)}, {"scene.json: lights[0].name", "at most 246", "400 letters"});
  expect_failure({"render", with_light(246), "-m", "hard", "--light-buffers"}, {"kkk", "file name", "shorten"});
  expect_failure({"render", with_light(3, std::string(230, 's') + ".json"), "-m", "hard"}, {"sss", "file name", "shorten"});
  const Result result = run({"render", with_light(246), "-m", "hard", "-q"});
  ASSERT_EQ(result.code, 0) << result.err;
  const std::string picture = "out/scene.hard.0001.exr", channel = "shadow_" + std::string(246, 'k') + ".Y";
  EXPECT_TRUE(read_exr(folder_ / picture).channels.contains(channel));
  const Result compared = run({"compare", picture, picture});
  EXPECT_TRUE(has(compared.out, channel + " over pixels facing light")) << compared.out << compared.err;
}

TEST_F(Cli, FramesThatCannotBeDrawnAreRefusedBeforeTheFirst) {
  const std::string file = scene([](nlohmann::json& json) {
    json["animation"] = {{"frames", {1, 9}},
                         {"tracks", {{{"target", "box.scale"}, {"keys", {{1, {1, 1, 1}}, {9, {-1, -1, -1}}}}}}}};
  });
  expect_failure({"render", file, "-m", "hard"},
                 {"scene.json: frame 5, moved by animation.tracks[0]: meshes[0].scale: ", "other than 0"});
  expect_failure({"render", scene([](nlohmann::json& json) {
                    json["animation"] = {{"frames", {-2147483647 - 1, 2147483647}}};
                  })},
                 {"scene.json: animation.frames", "from -1000000 to 1000000"});
}

/// Renders frames without end until there are a few, sends a signal, and waits for the program's end.
class StoppedRender : public Cli {
 protected:
  pid_t start() {
    const std::string long_one = scene([](nlohmann::json& json) { json["animation"] = {{"frames", {1, 100000}}}; });
    const pid_t child = fork();
    if (child == 0) {
      if (chdir(folder_.c_str()) != 0) _exit(126);
      execl(HALFSHADE_CLI, HALFSHADE_CLI, "render", long_one.c_str(), "-q", "-m", "hard", nullptr);
      _exit(127);
    }
    return child;
  }

  void wait_for_frames(std::size_t count) {
    for (int attempt = 0; attempt < 600 && files_in("out").size() < count; ++attempt) usleep(50'000);
  }

  static int signal_that_ended(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  }
};

TEST_F(StoppedRender, LeavesWholeFramesOnly) {
  for (int turn = 1; turn <= 4; ++turn) {
    const pid_t child = start();
    wait_for_frames(3);
    usleep(1'000 * turn);
    kill(child, SIGTERM);
    EXPECT_EQ(signal_that_ended(child), SIGTERM);
    const std::vector<std::string> files = files_in("out");
    EXPECT_GE(files.size(), 3u);
    for (const std::string& file : files) {
      EXPECT_TRUE(file.ends_with(".exr")) << file;
      EXPECT_NO_THROW(read_exr(folder_ / "out" / file)) << file;
    }
    std::filesystem::remove_all(folder_ / "out");
  }
}

TEST_F(StoppedRender, GoesOnAfterSignalsItWasToldToIgnore) {
  const auto before = std::signal(SIGHUP, SIG_IGN);  // as nohup does
  const pid_t child = start();
  std::signal(SIGHUP, before);
  wait_for_frames(1);
  kill(child, SIGHUP);
  const std::size_t frames = files_in("out").size();
  wait_for_frames(frames + 3);
  EXPECT_GE(files_in("out").size(), frames + 3);
  kill(child, SIGTERM);
  EXPECT_EQ(signal_that_ended(child), SIGTERM);
}

// ---------------------------------------------------------------------------------------------------------------- compare

/// A 4x3 picture with positions and normals of the ground y = 0, of which the last row sees nothing.
Frame ground_frame() {
  Frame frame;
  frame.resolution = {4, 3};
  for (int i = 0; i < 12; ++i) {
    const bool seen = i < 8;
    frame.rgb.emplace_back(0.5f);
    frame.position_ws.emplace_back(seen ? glm::vec4(i % 4 * 0.1f, 0, i / 4 * 0.1f, 1) : glm::vec4(0));
    frame.normal_ws.emplace_back(seen ? glm::vec4(0, 1, 0, 0) : glm::vec4(0));
    frame.depth.push_back(seen ? 5.0f : 0.0f);
  }
  frame.visibility = {std::vector<float>(12, 0.5f)};
  return frame;
}

const std::string ground_light = R"({"position":[0,5,0],"target":[0,0,0],"radius":0.1,"cone_deg":60})";

TEST_F(Cli, CompareFindsAPlantedDifferenceAndFailsBeyondTheLimit) {
  const std::vector<std::string> lights{"key"};
  Frame frame = ground_frame();
  write_frame_exr(folder_ / "b.exr", frame, lights, false, {{"light.key", ground_light}});
  frame.visibility[0][5] = 0.9f;
  frame.visibility[0][11] = 0.0f;  // sees nothing: does not count
  write_frame_exr(folder_ / "a.exr", frame, lights, false, {});

  const Result same = run({"compare", "b.exr", "b.exr", "--fail-rmse", "0"});
  EXPECT_EQ(same.code, 0) << same.err;
  const Result json = run({"compare", "a.exr", "b.exr", "--json"});
  ASSERT_EQ(json.code, 0) << json.err;
  const nlohmann::json figures = nlohmann::json::parse(json.out).at(0);
  EXPECT_EQ(figures.at("channel"), "shadow_key.Y");
  EXPECT_EQ(figures.at("counted_pixels"), 8);
  EXPECT_NEAR(figures.at("rmse").get<double>(), 0.4 / std::sqrt(8.0), 1e-6);
  EXPECT_NEAR(figures.at("bias").get<double>(), 0.05, 1e-6);
  EXPECT_EQ(run({"compare", "a.exr", "b.exr", "--fail-rmse", "0.142"}).code, 0);
  expect_failure({"compare", "a.exr", "b.exr", "--channel", "R", "--fail-rmse", "nan"}, {"--fail-rmse", "nan"});
  const Result beyond = run({"compare", "a.exr", "b.exr", "--fail-rmse", "0.141"});
  EXPECT_EQ(beyond.code, 1);
  EXPECT_TRUE(has(beyond.err, "0.141")) << beyond.err;
  EXPECT_TRUE(has(beyond.out, "penumbra_rmse"));
}

TEST_F(Cli, CompareCountsAllPixelsOfPicturesThatDoNotTell) {
  Frame frame = ground_frame();
  const std::vector<std::string> lights{"key"};
  write_frame_exr(folder_ / "b.exr", frame, lights, false, {});
  frame.visibility[0][11] = 0.0f;
  write_frame_exr(folder_ / "a.exr", frame, lights, false, {});
  const Result result = run({"compare", "a.exr", "b.exr", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out).at(0).at("counted_pixels"), 12);
  EXPECT_EQ(nlohmann::json::parse(result.out).at(0).at("max_error"), 0.5);
}

TEST_F(Cli, CompareDoesNotPassWhatIsNotANumber) {
  Frame frame = ground_frame();
  const std::vector<std::string> lights{"key"};
  write_frame_exr(folder_ / "b.exr", frame, lights, false, {});
  frame.visibility[0][2] = std::numeric_limits<float>::quiet_NaN();
  write_frame_exr(folder_ / "a.exr", frame, lights, false, {});
  const Result result = run({"compare", "a.exr", "b.exr", "--fail-rmse", "1"});
  EXPECT_EQ(result.code, 1);
  EXPECT_TRUE(has(result.err, "not finite")) << result.err;
  expect_failure({"compare", "b.exr", "a.exr"}, {"a.exr", "shadow_key.Y", "nan", "2, 0"});
}

TEST_F(Cli, CompareSaysWhatIsWrongWithItsFiles) {
  Frame frame = ground_frame();
  const std::vector<std::string> lights{"key"};
  write_frame_exr(folder_ / "b.exr", frame, lights, false, {{"light.key", "{}"}});
  write_frame_exr(folder_ / "c.exr", frame, {}, false, {});
  frame.resolution = {3, 4};
  write_frame_exr(folder_ / "a.exr", frame, lights, false, {});
  fs::copy_file(folder_ / "a.exr", folder_ / "cut.exr");
  fs::resize_file(folder_ / "cut.exr", fs::file_size(folder_ / "cut.exr") - 100);
  expect_failure({"compare", "none.exr", "b.exr"}, {"none.exr", "no such file"});
  expect_failure({"compare", "cut.exr", "a.exr"}, {"cut.exr", "whole EXR"});
  expect_failure({"compare", "a.exr", "b.exr"}, {"a.exr", "4x3", "3x4"});
  expect_failure({"compare", "b.exr", "c.exr"}, {"c.exr", "shadow_<light>.Y", "--channel"});
  expect_failure({"compare", "c.exr", "b.exr"}, {"c.exr", "shadow_key.Y", "depth.Z"});
  expect_failure({"compare", "b.exr", "b.exr"}, {"b.exr", "light.key", "{}"});
  write_frame_exr(folder_ / "d.exr", frame, lights, false, {{"light.key", "{\n\x1b[31m"}});
  expect_failure({"compare", "d.exr", "d.exr"}, {"d.exr", "light.key", "{??[31m"});
  expect_failure({"compare", "a.exr"}, {"B", "compare --help"});
}

TEST_F(Cli, RenderedFramesTellCompareWhichPixelsCount) {
  ASSERT_EQ(run({"render", scene(), "-m", "hard,pcf", "-q"}).code, 0);
  const Result result = run({"compare", "out/scene.pcf.0001.exr", "out/scene.hard.0001.exr"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_TRUE(has(result.out, "pixels facing light 'key'")) << result.out;
}

}  // namespace
}  // namespace halfshade
