// Every option that a method declares is wherever options are: over the registry, so that a new one cannot be forgotten.
#include <map>
#include <sstream>

#include "cli/cli_fixture.hpp"
#include "cli/draw_options.hpp"
#include "halfshade/halfshade.hpp"
#include "methods/option.hpp"
#include "report/candidates.hpp"

namespace halfshade {
namespace {

using Entries = std::map<std::string, std::string>;

Entries entries_of(const Settings& settings) {
  const auto entries = describe(settings);
  return {entries.begin(), entries.end()};
}

std::vector<std::string> words_of(std::string_view text) {
  std::istringstream stream{std::string(text)};
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// What `render` would draw with.
std::vector<Settings> parse(std::vector<std::string> arguments) {
  CLI::App program;
  DrawOptions options;
  options.add(program, "all");
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
  program.parse(arguments);
  return options.settings("all");
}

/// Calls `test` with every method and each of its options.
template <class Test>
void for_each_option(Test test) {
  for (const MethodInfo& info : methods()) {
    for (const Option& option : options_of(info.method)) {
      SCOPED_TRACE(fmt::format("{} --{}", info.name, option.name));
      test(info, option);
    }
  }
}

class MethodOptions : public Cli {};

TEST_F(MethodOptions, AreDeclaredForEveryMethod) {
  for (const MethodInfo& info : methods()) {
    std::string names;
    for (const Option& option : options_of(info.method)) names += fmt::format("{}{}", names.empty() ? "" : " ", option.name);
    EXPECT_EQ(names, info.options) << info.name;
    EXPECT_NE(names, "") << info.name;
  }
}

TEST_F(MethodOptions, AreOnTheCommandLine) {
  const std::string render = run({"render", "--help"}).out, bench = run({"bench", "--help"}).out;
  for_each_option([&](const MethodInfo& info, const Option& option) {
    const std::string flag = fmt::format("--{}", option.name);
    EXPECT_TRUE(has(render, flag + " ") || has(render, flag + "\n"));
    EXPECT_TRUE(has(bench, flag + " ") || has(bench, flag + "\n"));
    const std::string help = option_help(option.name);
    EXPECT_TRUE(has(help, option.summary)) << help;
    std::size_t users = 0;
    for (const MethodInfo& other : methods()) users += find_option(other.method, option.name) != nullptr;
    EXPECT_TRUE(users == methods().size() || has(help, info.name)) << help;
    EXPECT_TRUE(option.is_switch() || has(help, option.text({.method = info.method}))) << help;
  });
}

TEST_F(MethodOptions, TakeTheirOwnDefaultsAsTyped) {
  for_each_option([](const MethodInfo& info, const Option& option) {
    const Settings defaults{.method = info.method};
    const std::string method(info.name), flag = fmt::format("--{}", option.name);
    const std::vector<Settings> parsed =
        option.is_switch() ? parse({"-m", method}) : parse({"-m", method, flag, option.text(defaults)});
    ASSERT_EQ(parsed.size(), 1u);
    EXPECT_EQ(entries_of(parsed.front()), entries_of(defaults));
  });
}

TEST_F(MethodOptions, AreDescribedWithTheValueThatIsTyped) {
  for_each_option([](const MethodInfo& info, const Option& option) {
    EXPECT_EQ(entries_of({.method = info.method}).at(std::string(option.key)), option.text({.method = info.method}));
    for (const std::string& value : words_of(option.measured)) {
      if (option.is_switch() && value == "no") continue;  // which is not to type it
      const std::string method(info.name), flag = fmt::format("--{}", option.name);
      const std::vector<Settings> parsed = option.is_switch() ? parse({"-m", method, flag}) : parse({"-m", method, flag, value});
      ASSERT_EQ(parsed.size(), 1u);
      EXPECT_EQ(entries_of(parsed.front()).at(std::string(option.key)), value);
    }
  });
}

TEST_F(MethodOptions, AreParsedByEachChosenMethodForItself) {
  const std::vector<Settings> all = parse({"--light-res", "77"});
  ASSERT_EQ(all.size(), methods().size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].method, methods()[i].method);
    EXPECT_EQ(all[i].light_resolution_px, 77u);
  }
}

TEST_F(MethodOptions, AreListedAsJson) {
  const Result result = run({"methods", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  ASSERT_EQ(json.size(), methods().size());
  std::size_t row = 0;
  for (const MethodInfo& info : methods()) {
    const nlohmann::json& method = json.at(row++);
    EXPECT_EQ(method.at("name"), info.name);
    EXPECT_EQ(method.at("summary"), info.summary);
    EXPECT_EQ(method.at("exact_when"), info.exact_when);
    EXPECT_EQ(method.at("any_shape"), info.any_shape);
    EXPECT_EQ(method.at("is_default"), info.method == Settings{}.method);
    ASSERT_EQ(method.at("options").size(), options_of(info.method).size());
    std::size_t column = 0;
    for (const Option& option : options_of(info.method)) {
      const nlohmann::json& listed = method.at("options").at(column++);
      EXPECT_EQ(listed.at("name"), option.name);
      EXPECT_EQ(listed.at("key"), option.key);
      EXPECT_EQ(listed.at("values"), option.values);
      EXPECT_EQ(listed.at("switch"), option.is_switch());
      EXPECT_EQ(listed.at("default"), option.text({.method = info.method}));
      EXPECT_EQ(listed.at("summary"), option.summary);
    }
  }
}

TEST_F(MethodOptions, AreMeasuredByTheReportOverTheirDeclaredValues) {
  for (const bool quick : {false, true}) {
    const std::vector<Candidate> all = candidates({.quick = quick});
    for_each_option([&](const MethodInfo& info, const Option& option) {
      for (const std::string& value : words_of(quick ? option.measured_quickly : option.measured)) {
        const auto has_value = [&](const Candidate& candidate) {
          const Settings* settings = std::get_if<Settings>(&candidate.how);
          return candidate.name == info.name && settings != nullptr && option.text(*settings) == value;
        };
        EXPECT_TRUE(std::any_of(all.begin(), all.end(), has_value)) << value;
      }
    });
  }
}

TEST_F(MethodOptions, RefuseValuesOutOfRange) {
  const std::string name = scene();
  for_each_option([&](const MethodInfo& info, const Option& option) {
    // "-1" would turn a switch off.
    const std::vector<std::string> values = option.is_switch() ? std::vector<std::string>{"nonsense"}
                                                               : std::vector<std::string>{"nonsense", "-1", "1e30", "", "0x10"};
    for (const std::string& value : values)
      expect_failure({"render", name, "-m", std::string(info.name), fmt::format("--{}={}", option.name, value)},
                     {fmt::format("--{}", option.name)});
  });
}

TEST_F(MethodOptions, AreRefusedWhereNoChosenMethodUsesThem) {
  for_each_option([](const MethodInfo&, const Option& option) {
    for (const MethodInfo& other : methods()) {
      if (find_option(other.method, option.name) != nullptr) continue;
      const std::string flag = fmt::format("--{}", option.name), method(other.name);
      try {
        option.is_switch() ? parse({"-m", method, flag}) : parse({"-m", method, flag, "1"});
        ADD_FAILURE() << other.name << " takes it";
      } catch (const InputError& error) {
        EXPECT_TRUE(std::string_view(error.what()).starts_with(flag + ": ")) << error.what();
        EXPECT_TRUE(has(error.what(), "has no use for it")) << error.what();
      }
    }
  });
}

}  // namespace
}  // namespace halfshade
