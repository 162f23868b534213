// How report.html looks and behaves; nothing in it comes from elsewhere.
#ifndef CIRCLINE_APPS_COMPARE_REPORT_STYLE_H_
#define CIRCLINE_APPS_COMPARE_REPORT_STYLE_H_

namespace circline::apps {

extern const char* const kReportStyle;   // CSS.
extern const char* const kReportScript;  // Sorting, choosing photos, zoom.

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_REPORT_STYLE_H_
