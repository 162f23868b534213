#include "tests/apps/measured_rows.h"

#include <gtest/gtest.h>

#include <sstream>
#include <vector>

#include "tests/apps/test_files.h"

namespace circline::apps {

std::map<std::string, MeasuredRow> ReadMeasurements(const std::string& path) {
  std::map<std::string, MeasuredRow> rows;
  std::istringstream csv(ReadAll(path));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line, "what,id,value,sigma,unit,truth,relative_error");
  while (std::getline(csv, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line + ",");  // An empty last cell is one, too.
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    EXPECT_EQ(cells.size(), 7U) << line;
    if (cells.size() != 7) continue;
    const auto number = [](const std::string& cell) {
      return cell.empty() ? 0.0 : std::stod(cell);
    };
    rows[cells[0] + " " + cells[1].substr(1, cells[1].size() - 2)] = {
        number(cells[2]), number(cells[3]), number(cells[5]), number(cells[6]), cells[4]};
  }
  return rows;
}

}  // namespace circline::apps
