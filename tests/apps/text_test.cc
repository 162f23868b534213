#include "apps/common/text.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace circline::apps {
namespace {

TEST(Text, SplitsLists) {
  EXPECT_EQ(SplitList("a, b,,c "), (std::vector<std::string>{"a", "b", "", "c"}));
  EXPECT_EQ(SplitList(""), std::vector<std::string>{""});
}

TEST(Text, ParsesWholeNumbersOnly) {
  double value = 0.0;
  EXPECT_TRUE(ParseDouble("1.5e-3", &value));
  EXPECT_EQ(value, 1.5e-3);
  for (const char* text : {"", "1.5x", "nan", "inf", " "})
    EXPECT_FALSE(ParseDouble(text, &value)) << text;
  int whole = 0;
  EXPECT_TRUE(ParseInt("-12", &whole));
  EXPECT_EQ(whole, -12);
  for (const char* text : {"", "1.5", "99999999999", "x"})
    EXPECT_FALSE(ParseInt(text, &whole)) << text;
}

TEST(Text, FindsTheNameThatWasMeant) {
  const std::vector<std::string> names = {"scene", "seed", "camera"};
  EXPECT_EQ(DidYouMean("scnee", names), "; did you mean 'scene'?");
  EXPECT_EQ(DidYouMean("cammera", names), "; did you mean 'camera'?");
  EXPECT_EQ(DidYouMean("quality", names), "");
}

TEST(Text, FormatsNumbersForPeople) {
  EXPECT_EQ(FormatShort(0.0123456), "0.0123");
  EXPECT_EQ(FormatShort(1.23456), "1.23");
  EXPECT_EQ(FormatShort(1234.5), "1234");
  EXPECT_EQ(FormatShort(5e-15), "0");
  EXPECT_EQ(FormatShort(std::numeric_limits<double>::quiet_NaN()), "-");
  EXPECT_EQ(FormatFixed(-0.04, 1), "0.0");
  EXPECT_EQ(FormatFixed(-0.06, 1), "-0.1");
  EXPECT_EQ(FormatFixed(-0.4, 0), "0");
  EXPECT_EQ(FormatMicroseconds(412.4), "412 us");
  EXPECT_EQ(FormatMicroseconds(3140.0), "3.1 ms");
  EXPECT_EQ(FormatMicroseconds(2.4e6), "2.4 s");
}

TEST(Text, EscapesHtml) { EXPECT_EQ(EscapeHtml("<a & 'b'>"), "&lt;a &amp; &#39;b&#39;&gt;"); }

TEST(Text, EncodesBase64) {  // RFC 4648, section 10.
  EXPECT_EQ(EncodeBase64(""), "");
  EXPECT_EQ(EncodeBase64("f"), "Zg==");
  EXPECT_EQ(EncodeBase64("fo"), "Zm8=");
  EXPECT_EQ(EncodeBase64("foo"), "Zm9v");
  EXPECT_EQ(EncodeBase64("foob"), "Zm9vYg==");
  EXPECT_EQ(EncodeBase64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(EncodeBase64("foobar"), "Zm9vYmFy");
}

TEST(Text, PlainNumbersHaveNoIdleZeros) {
  EXPECT_EQ(FormatPlain(0.1), "0.1");
  EXPECT_EQ(FormatPlain(2.0), "2");
  EXPECT_EQ(FormatPlain(0.03), "0.03");
  EXPECT_EQ(FormatPlain(1e-6), "1e-06");
}

}  // namespace
}  // namespace circline::apps
