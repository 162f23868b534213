// The tables of report.html; empty where there is nothing to show.
#ifndef CIRCLINE_APPS_COMPARE_REPORT_TABLES_H_
#define CIRCLINE_APPS_COMPARE_REPORT_TABLES_H_

#include <string>

#include "apps/compare/agreement.h"
#include "apps/compare/summary.h"

namespace circline::apps {

// A cell, its text escaped; `css`: its class.
std::string Cell(const std::string& text, const char* css = nullptr);

std::string SummaryTable(const Summary& summary);

// A row and a column for each solver that answered together with some other.
std::string AgreementTable(const Agreement& agreement);

// A row for each loss and scale, a column for each solver, the best of each column marked.
std::string SweepTable(const Summary& summary);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_REPORT_TABLES_H_
