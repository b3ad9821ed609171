// What a report measures.
#include "report/candidates.hpp"

#include <gtest/gtest.h>

#include <set>

#include "support/temp_folder.hpp"

namespace halfshade {
namespace {

/// The rows of a report, "*" at a method's defaults. Their names are those of earlier reports, which people compare with.
// clang-format off
const std::vector<std::string> full_report{
    "  hard light_resolution_px=256",
    "  hard light_resolution_px=512",
    "* hard light_resolution_px=1024",
    "  hard light_resolution_px=2048",
    "  hard light_resolution_px=4096",
    "  pcf light_resolution_px=256 pcf_filter=2",
    "  pcf light_resolution_px=512 pcf_filter=2",
    "* pcf light_resolution_px=1024 pcf_filter=2",
    "  pcf light_resolution_px=2048 pcf_filter=2",
    "  pcf light_resolution_px=4096 pcf_filter=2",
    "  pcf light_resolution_px=1024 pcf_filter=4",
    "  pcss light_resolution_px=256 pcss_taps=32",
    "  pcss light_resolution_px=512 pcss_taps=32",
    "* pcss light_resolution_px=1024 pcss_taps=32",
    "  pcss light_resolution_px=2048 pcss_taps=32",
    "  pcss light_resolution_px=4096 pcss_taps=32",
    "  pcss light_resolution_px=1024 pcss_taps=16",
    "  smoothies light_resolution_px=256 smoothie_width=auto falloff=sine",
    "  smoothies light_resolution_px=512 smoothie_width=auto falloff=sine",
    "* smoothies light_resolution_px=1024 smoothie_width=auto falloff=sine",
    "  smoothies light_resolution_px=2048 smoothie_width=auto falloff=sine",
    "  smoothies light_resolution_px=4096 smoothie_width=auto falloff=sine",
    "  smoothies light_resolution_px=1024 smoothie_width=0.02 falloff=sine",
    "  smoothies light_resolution_px=1024 smoothie_width=0.05 falloff=sine",
    "  smoothies light_resolution_px=1024 smoothie_width=0.1 falloff=sine",
    "  smoothies light_resolution_px=1024 smoothie_width=0.2 falloff=sine",
    "  smoothies light_resolution_px=1024 smoothie_width=auto falloff=linear",
    "  smoothies light_resolution_px=1024 smoothie_width=auto falloff=bernstein",
    "  smoothies light_resolution_px=1024 smoothie_width=auto falloff=disc",
    "  smoothies light_resolution_px=1024 smoothie_width=auto falloff=sine faithful=yes",
    "  penumbra-maps light_resolution_px=256 falloff=bernstein",
    "  penumbra-maps light_resolution_px=512 falloff=bernstein",
    "* penumbra-maps light_resolution_px=1024 falloff=bernstein",
    "  penumbra-maps light_resolution_px=2048 falloff=bernstein",
    "  penumbra-maps light_resolution_px=4096 falloff=bernstein",
    "  penumbra-maps light_resolution_px=1024 falloff=linear",
    "  penumbra-maps light_resolution_px=1024 falloff=sine",
    "  penumbra-maps light_resolution_px=1024 falloff=disc",
    "  penumbra-maps light_resolution_px=1024 falloff=bernstein faithful=yes",
    "  fins light_resolution_px=256 falloff=disc",
    "  fins light_resolution_px=512 falloff=disc",
    "* fins light_resolution_px=1024 falloff=disc",
    "  fins light_resolution_px=2048 falloff=disc",
    "  fins light_resolution_px=4096 falloff=disc",
    "  fins light_resolution_px=1024 falloff=linear",
    "  fins light_resolution_px=1024 falloff=bernstein",
    "  fins light_resolution_px=1024 falloff=sine",
    "  fins light_resolution_px=1024 falloff=bernstein faithful=yes",
    "  layered-fins light_resolution_px=256 falloff=disc layers=auto",
    "  layered-fins light_resolution_px=512 falloff=disc layers=auto",
    "* layered-fins light_resolution_px=1024 falloff=disc layers=auto",
    "  layered-fins light_resolution_px=2048 falloff=disc layers=auto",
    "  layered-fins light_resolution_px=4096 falloff=disc layers=auto",
    "  layered-fins light_resolution_px=1024 falloff=linear layers=auto",
    "  layered-fins light_resolution_px=1024 falloff=bernstein layers=auto",
    "  layered-fins light_resolution_px=1024 falloff=sine layers=auto",
    "  layered-fins light_resolution_px=1024 falloff=disc layers=4",
    "  layered-fins light_resolution_px=1024 falloff=disc layers=16",
    "  layered-fins light_resolution_px=1024 falloff=disc layers=64",
    "  layered-fins light_resolution_px=1024 falloff=bernstein layers=16 faithful=yes",
    "  light-samples light_resolution_px=256 samples=64",
    "  light-samples light_resolution_px=512 samples=64",
    "* light-samples light_resolution_px=1024 samples=64",
    "  light-samples light_resolution_px=2048 samples=64",
    "  light-samples light_resolution_px=4096 samples=64",
    "  light-samples light_resolution_px=1024 samples=16",
    "  light-samples light_resolution_px=1024 samples=256",
    "  light-samples light_resolution_px=1024 samples=1024",
    "  exact light_resolution_px=256 samples=256 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=512 samples=256 sample_pattern=fixed alias_free=no",
    "* exact light_resolution_px=1024 samples=256 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=2048 samples=256 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=4096 samples=256 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=1024 samples=16 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=1024 samples=64 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=1024 samples=1024 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=1024 samples=256 sample_pattern=rotated alias_free=no",
    "  exact light_resolution_px=1024 samples=256 sample_pattern=fixed alias_free=yes",
    "  rays samples=1",
    "  rays samples=4",
    "  rays samples=16",
    "  rays samples=64",
    "  rays samples=256",
    "  rays-adaptive samples=16 more_samples=64",
    "  rays-adaptive samples=16 more_samples=256",
};

const std::vector<std::string> quick_report{
    "  hard light_resolution_px=512",
    "* hard light_resolution_px=1024",
    "  hard light_resolution_px=2048",
    "  pcf light_resolution_px=512 pcf_filter=2",
    "* pcf light_resolution_px=1024 pcf_filter=2",
    "  pcf light_resolution_px=2048 pcf_filter=2",
    "  pcf light_resolution_px=1024 pcf_filter=4",
    "  pcss light_resolution_px=512 pcss_taps=32",
    "* pcss light_resolution_px=1024 pcss_taps=32",
    "  pcss light_resolution_px=2048 pcss_taps=32",
    "  pcss light_resolution_px=1024 pcss_taps=16",
    "  smoothies light_resolution_px=512 smoothie_width=auto falloff=sine",
    "* smoothies light_resolution_px=1024 smoothie_width=auto falloff=sine",
    "  smoothies light_resolution_px=2048 smoothie_width=auto falloff=sine",
    "  smoothies light_resolution_px=1024 smoothie_width=auto falloff=sine faithful=yes",
    "  penumbra-maps light_resolution_px=512 falloff=bernstein",
    "* penumbra-maps light_resolution_px=1024 falloff=bernstein",
    "  penumbra-maps light_resolution_px=2048 falloff=bernstein",
    "  penumbra-maps light_resolution_px=1024 falloff=bernstein faithful=yes",
    "  fins light_resolution_px=512 falloff=disc",
    "* fins light_resolution_px=1024 falloff=disc",
    "  fins light_resolution_px=2048 falloff=disc",
    "  fins light_resolution_px=1024 falloff=bernstein faithful=yes",
    "  layered-fins light_resolution_px=512 falloff=disc layers=auto",
    "* layered-fins light_resolution_px=1024 falloff=disc layers=auto",
    "  layered-fins light_resolution_px=2048 falloff=disc layers=auto",
    "  layered-fins light_resolution_px=1024 falloff=disc layers=16",
    "  layered-fins light_resolution_px=1024 falloff=bernstein layers=16 faithful=yes",
    "  light-samples light_resolution_px=512 samples=64",
    "* light-samples light_resolution_px=1024 samples=64",
    "  light-samples light_resolution_px=2048 samples=64",
    "  light-samples light_resolution_px=1024 samples=16",
    "  light-samples light_resolution_px=1024 samples=256",
    "  exact light_resolution_px=512 samples=256 sample_pattern=fixed alias_free=no",
    "* exact light_resolution_px=1024 samples=256 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=2048 samples=256 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=1024 samples=16 sample_pattern=fixed alias_free=no",
    "  exact light_resolution_px=1024 samples=64 sample_pattern=fixed alias_free=no",
    "  rays samples=1",
    "  rays samples=4",
    "  rays samples=16",
    "  rays samples=64",
    "  rays-adaptive samples=16 more_samples=64",
};
// clang-format on

std::vector<std::string> labels_of(const CandidateSelection& selection) {
  std::vector<std::string> labels;
  for (const Candidate& candidate : candidates(selection)) labels.push_back(candidate.label());
  return labels;
}

TEST(Candidates, AreTheseInThisOrder) {
  for (const bool quick : {false, true}) {
    std::vector<std::string> rows;
    for (const Candidate& candidate : candidates({.quick = quick}))
      rows.push_back((candidate.is_default ? "* " : "  ") + candidate.label());
    EXPECT_EQ(rows, quick ? quick_report : full_report);
  }
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
  CandidateSelection selection;
  selection.names = {"hard", "rays"};
  selection.light_resolutions_px = {64, 128};
  selection.quick = true;
  EXPECT_EQ(labels_of(selection),
            (std::vector<std::string>{"hard light_resolution_px=64", "hard light_resolution_px=128", "rays samples=1",
                                      "rays samples=4", "rays samples=16", "rays samples=64"}));
  selection.names = {"nonsense"};
  expect_error<InputError>([&] { candidates(selection); }, {"nonsense", "hard", "rays-adaptive"});
}

}  // namespace
}  // namespace halfshade
