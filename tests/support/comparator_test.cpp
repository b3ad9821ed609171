#include "support/comparator.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace halfshade {
namespace {

constexpr ImageRule rule{.percent = 10.0, .threshold = 0.05, .hard = 0.5};

std::vector<float> grey(std::size_t pixels, std::size_t channels = 1) {
  return std::vector<float>(pixels * channels, 0.25f);
}

bool agree(const std::vector<float>& a, const std::vector<float>& b, std::size_t channels = 1) {
  return image_difference(a, b, channels, rule).empty();
}

TEST(Comparator, EqualPicturesAgree) {
  EXPECT_TRUE(agree(grey(100), grey(100)));
}

TEST(Comparator, SmallDifferencesEverywhereAgree) {
  std::vector<float> other = grey(100);
  for (float& value : other) value += 0.04f;
  EXPECT_TRUE(agree(grey(100), other));
  EXPECT_TRUE(agree(other, grey(100)));
}

TEST(Comparator, FailsWhereTooManyPixelsDiffer) {
  std::vector<float> other = grey(100);
  for (int i = 0; i < 10; ++i) other[i * 7] += 0.06f;
  EXPECT_TRUE(agree(grey(100), other));
  other[99] -= 0.06f;
  EXPECT_FALSE(agree(grey(100), other));
  EXPECT_FALSE(agree(other, grey(100)));
}

TEST(Comparator, FailsWhereOnePixelDiffersTooMuch) {
  std::vector<float> other = grey(100);
  other[42] += 0.49f;
  EXPECT_TRUE(agree(grey(100), other));
  other[42] += 0.02f;
  EXPECT_FALSE(agree(grey(100), other));
  EXPECT_FALSE(agree(other, grey(100)));
  EXPECT_NE(image_difference(grey(100), other, 1, rule).find("pixel 42"), std::string::npos);
}

TEST(Comparator, CountsPixelsNotChannels) {
  std::vector<float> other = grey(100, 3);
  for (int i = 0; i < 30; ++i) other[i] += 0.1f;  // ten pixels, three channels each
  EXPECT_TRUE(agree(grey(100, 3), other, 3));
  for (int i = 0; i < 100; ++i) other[i * 3 + 2] += 0.1f;  // one channel of every pixel
  EXPECT_FALSE(agree(grey(100, 3), other, 3));
}

TEST(Comparator, FailsOnWhatIsNoNumber) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    std::vector<float> other = grey(100);
    other[3] = bad;
    EXPECT_FALSE(agree(grey(100), other));
    EXPECT_FALSE(agree(other, grey(100)));
    EXPECT_FALSE(agree(other, other));
  }
}

TEST(Comparator, FailsOnOtherSizesAndOnNothing) {
  EXPECT_FALSE(agree(grey(100), grey(99)));
  EXPECT_FALSE(agree({}, {}));
  EXPECT_FALSE(agree(grey(100), grey(100), 3));
}

}  // namespace
}  // namespace halfshade
