// SPDX-License-Identifier: MIT
#include "stereo_slam/report/report.hpp"

#include <nlohmann/json.hpp>

#include "stereo_slam/report/page.hpp"
#include "stereo_slam/report/run_data.hpp"

namespace stereo_slam::report {

void write_report(std::ostream& stream, const RunRecord& record, const RunInfo& info) {
  write_page(stream, kReportGenerator, run_data(record, info));
}

}  // namespace stereo_slam::report
