#include "apps/report.hpp"

#include "apps/atomic_file.hpp"
#include "apps/byte_codec.hpp"
#include "apps/report_data.hpp"
#include "apps/report_plots.hpp"
#include "apps/svg_plot.hpp"
#include "apps/viewer_files.hpp"

#include <string>

namespace stairwell::apps {
namespace {

/// Tables, plots, picture and the viewer itself take this much at most.
constexpr std::size_t kOther_bytes = 2'500'000;

/// Says so when the page's end, which is its last element, is missing.
constexpr const char* kGuard =
    "<script>addEventListener('DOMContentLoaded',()=>{if(document.getElementById('end'))return;"
    "const p=document.createElement('p');p.className='notice';p.setAttribute('role','alert');"
    "p.textContent='This report is truncated: the file ends too early. Make it again: stairwell report DIR';"
    "document.body.prepend(p)})</script>";

std::string label(const RunData& run, const char* key) {
  const auto found = run.metrics.find(key);
  if (found == run.metrics.end()) return "";
  return found->is_string() ? found->get<std::string>() : found->dump();
}

std::string world_of(const RunData& run) {
  const std::string world = label(run, "world");
  return world.empty() ? "a world" : std::filesystem::path(world).stem().string();
}

std::string title_of(const std::vector<RunData>& runs) {
  std::string title = "Exploration of " + world_of(runs.front());
  if (runs.size() > 1) title += ": " + runs[0].name + " and " + runs[1].name;
  return title;
}

std::string subtitle(const RunData& run) {
  const std::string uavs = label(run, "uavs");
  std::string text = label(run, "mode");
  if (!uavs.empty()) text += (text.empty() ? "" : " \u00b7 ") + uavs + (uavs == "1" ? " UAV" : " UAVs");
  if (const std::string planner = label(run, "planner"); !planner.empty()) text += " \u00b7 " + planner;
  if (const std::string seed = label(run, "seed"); !seed.empty()) text += " \u00b7 seed " + seed;
  return text;
}

std::string head(const std::string& title) {
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; "
         "style-src 'unsafe-inline'; img-src data: blob:\">\n"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
         "<meta name=\"color-scheme\" content=\"light dark\">\n" +
         std::string(kGuard) + "\n<title>" + escape_html(title) + "</title>\n<style>" + kViewerStyle +
         "</style></head>\n";
}

std::string picture(const RunData& run) {
  return "<img class=\"snapshot\" alt=\"The explored map of " + escape_html(run.name) +
         ", storeys cut open, with the UAVs' paths\" src=\"data:image/png;base64," + base64(run.snapshot) + "\">";
}

/// The viewer takes the place of the pictures where the browser can show it.
std::string replay_section(const std::vector<RunData>& runs) {
  std::string html = "<section id=\"replay\" aria-label=\"Replay\">";
  for (const RunData& run : runs) html += picture(run);
  return html +
         "<noscript><p class=\"notice\">The 3D replay needs JavaScript; this picture does "
         "not.</p></noscript></section>\n";
}

/// A shell command that holds the whole configuration.
std::string repeat_command(const RunData& run) {
  std::string end = "END";
  while (run.config.find("\n" + end + "\n") != std::string::npos) end += "_";
  return "stairwell explore --config /dev/stdin <<'" + end + "'\n" + run.config +
         (run.config.ends_with('\n') ? "" : "\n") + end;
}

std::string run_details(const RunData& run, bool named) {
  const std::string of = named ? " of " + escape_html(run.name) : "";
  return "<h2>Run" + of + "</h2><div class=\"plots\">" + run_plots(run) + "</div>";
}

std::string configuration(const RunData& run, bool named) {
  const std::string of = named ? " of " + escape_html(run.name) : "";
  return "<h2>Repeat this run" + of + "</h2><pre tabindex=\"0\" aria-label=\"Command and resolved configuration\">" +
         escape_html(repeat_command(run)) + "</pre>";
}

std::string page_of(const std::vector<RunData>& runs, std::size_t most_bytes) {
  const bool several = runs.size() > 1;
  const std::string title = title_of(runs);
  std::string html = head(title) + "<body>\n<header><h1>" + escape_html(title) + "</h1>";
  for (const RunData& run : runs) {
    html += "<p>" + (several ? "<b>" + escape_html(run.name) + "</b> " : std::string()) + escape_html(subtitle(run)) +
            "</p>";
  }
  html += "</header>\n<main>\n" + replay_section(runs);
  for (const RunData& run : runs) {
    if (several) html += "<h2>" + escape_html(run.name) + "</h2>";
    html += key_numbers(run.metrics);
  }
  html += "<h2>Progress</h2><div class=\"plots\">" + joint_plots(runs) + "</div>\n";
  for (const RunData& run : runs) html += run_details(run, several);
  html += "<div class=\"two\"><section><h2>Metrics</h2>" + metrics_table(runs) + "</section>\n<section>";
  for (const RunData& run : runs) html += configuration(run, several);
  html += "</section></div>\n</main>\n";
  for (const RunData& run : runs) html += packed_run(run, most_bytes);
  return html + "<script>" + kViewerScript + "</script>\n<i id=\"end\" hidden></i></body></html>\n";
}

}  // namespace

void write_report(const std::vector<std::filesystem::path>& run_dirs, const std::filesystem::path& file) {
  std::vector<RunData> runs;
  for (const std::filesystem::path& dir : run_dirs) runs.push_back(read_run(dir));
  write_file_atomically(file, page_of(runs, kMostReportBytes - kOther_bytes));
}

void write_report(const std::filesystem::path& run_dir) { write_report({run_dir}, run_dir / "report.html"); }

}  // namespace stairwell::apps
