// Small helpers on text: lists, numbers, names that were meant, HTML.
#ifndef CIRCLINE_APPS_COMMON_TEXT_H_
#define CIRCLINE_APPS_COMMON_TEXT_H_

#include <cstdint>
#include <exception>
#include <string>
#include <vector>

namespace circline::apps {

// "a, b,c" -> {"a", "b", "c"}; blanks around the parts are removed, empty parts are kept.
std::vector<std::string> SplitList(const std::string& text, char separator = ',');
std::string JoinList(const std::vector<std::string>& parts, const std::string& separator);
// Unless it is among them.
void AddOnce(const std::string& name, std::vector<std::string>* names);

// The whole text as a finite number, or false.
bool ParseDouble(const std::string& text, double* value);
bool ParseInt(const std::string& text, int* value);

// "; did you mean 'x'?" where one of the candidates is near enough to `name`, else "".
std::string DidYouMean(const std::string& name, const std::vector<std::string>& candidates);

// "'fish' is not one of pinhole, opencv, fisheye", and which was meant, as above.
std::string NotOneOf(const std::string& name, const std::vector<std::string>& known);

// Fixed number of decimals; "-" for what is not finite.
std::string FormatFixed(double value, int decimals);
// About `digits` significant digits without an exponent where that is readable (0.012, 3.4, 120).
std::string FormatShort(double value, int digits = 3);
// As short as so many digits can be: "0.1", "2", "1e-06".
std::string FormatPlain(double value, int digits = 6);
// "412 us", "3.1 ms", "2.4 s".
std::string FormatMicroseconds(double microseconds);

std::string EscapeHtml(const std::string& text);
std::string EncodeBase64(const std::string& bytes);

// A line for a terminal: control characters, which may move the cursor or end the line, as \xNN.
std::string WithoutControls(const std::string& text);

// What was thrown, in words.
std::string Words(const std::exception& error);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_TEXT_H_
