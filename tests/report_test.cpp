// What a report measures, and what it makes of it.
#include "report.hpp"

#include <gtest/gtest.h>

#include <set>

#include "report_page.hpp"
#include "temp_folder.hpp"

namespace halfshade {
namespace {

TEST(ParetoFront, HoldsWhatNoOtherPointBeats) {
  const std::vector<Tradeoff> points{{1, 9}, {2, 5}, {2, 6}, {3, 5}, {4, 1}, {5, 2}, {4, 1}};
  EXPECT_EQ(pareto_front(points), (std::vector<bool>{true, true, false, false, true, false, true}));
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(RaysTimeAtError, IsOnStraightLinesOfTheLogLogPlot) {
  // Error falls with the square root of time; a slow and bad one among them does not matter.
  const std::vector<Tradeoff> rays{{1, 0.1}, {100, 0.01}, {50, 0.2}, {10000, 0.001}};
  EXPECT_NEAR(*rays_time_at_error(rays, 0.0316227766), 10.0, 1e-6);
  EXPECT_NEAR(*rays_time_at_error(rays, 0.00316227766), 1000.0, 1e-4);
  EXPECT_DOUBLE_EQ(*rays_time_at_error(rays, 0.01), 100.0);
  EXPECT_DOUBLE_EQ(*rays_time_at_error(rays, 0.5), 1.0);
  EXPECT_EQ(rays_time_at_error(rays, 0.0009), std::nullopt);
  EXPECT_EQ(rays_time_at_error({}, 0.5), std::nullopt);
}

TEST(Median, OfEvenAndOddNumbers) {
  EXPECT_EQ(median_of({3, 1, 2}), 2);
  EXPECT_EQ(median_of({4, 1, 2, 3}), 2.5);
  EXPECT_EQ(median_of({}), 0);
}

TEST(Candidates, AreEveryMethodAndRivalOnceEach) {
  std::set<std::string> labels, defaults, names;
  for (const Candidate& candidate : candidates({})) {
    EXPECT_TRUE(labels.insert(candidate.label()).second) << candidate.label();
    names.insert(candidate.name);
    if (candidate.is_default) {
      EXPECT_TRUE(defaults.insert(candidate.name).second) << candidate.name;
    }
  }
  for (const MethodInfo& info : methods()) {
    EXPECT_TRUE(names.contains(std::string(info.name))) << info.name;
    EXPECT_TRUE(defaults.contains(std::string(info.name))) << info.name;
  }
  EXPECT_TRUE(names.contains("rays-adaptive"));
  EXPECT_TRUE(labels.contains("rays samples=256"));
}

TEST(Candidates, AreWhatIsAskedFor) {
  const auto labels = [](const ReportOptions& options) {
    std::vector<std::string> all;
    for (const Candidate& candidate : candidates(options)) all.push_back(candidate.label());
    return all;
  };
  ReportOptions options;
  options.names = {"hard", "rays"};
  options.light_resolutions_px = {64, 128};
  options.quick = true;
  EXPECT_EQ(labels(options),
            (std::vector<std::string>{"hard light_resolution_px=64", "hard light_resolution_px=128", "rays samples=1",
                                      "rays samples=4", "rays samples=16", "rays samples=64"}));
  options.names = {"nonsense"};
  expect_error<InputError>([&] { candidates(options); }, {"nonsense", "hard", "rays-adaptive"});
}

TEST(ReportPage, CannotBeEndedByANameInIt) {
  const std::string page =
      report_page({{"scenes", nlohmann::ordered_json::array()}, {"command", "</script><script>alert(1)"}}, ".");
  EXPECT_EQ(page.find("</script><script>alert"), page.npos);
  EXPECT_NE(page.find("\\u003c/script>"), page.npos);
  EXPECT_EQ(page.find("{{"), page.npos);
}

}  // namespace
}  // namespace halfshade
