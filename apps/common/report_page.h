// What every report.html begins and ends with; nothing in it comes from elsewhere.
#ifndef CIRCLINE_APPS_COMMON_REPORT_PAGE_H_
#define CIRCLINE_APPS_COMMON_REPORT_PAGE_H_

#include <string>
#include <vector>

namespace circline::apps {

// Up to the body's first element, with the style.
std::string PageTop(const std::string& title);
// From the body's last element on, with the script: sorting, choosing photos, zoom.
std::string PageEnd();

// A cell of a table, its text escaped; `css`: its class.
std::string CellHtml(const std::string& text, const std::string& css = "");

// A list; nothing where there are no sentences.
std::string ListHtml(const std::vector<std::string>& sentences, const std::string& css = "say");

// An <img> element that has the picture in it.
std::string PictureHtml(const std::string& alt, const std::string& jpeg);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_REPORT_PAGE_H_
