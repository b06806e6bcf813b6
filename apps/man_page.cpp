#include "apps/man_page.hpp"

#include "core/version.hpp"

#include <CLI/CLI.hpp>

#include <sstream>
#include <string_view>

namespace stairwell::apps {

namespace {

/// Text as it is: no character of it is a request or an escape.
std::string literal(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\e";
    } else if (c == '-') {
      escaped += "\\-";
    } else if ((c == '.' || c == '\'') && (escaped.empty() || escaped.back() == '\n')) {
      escaped += std::string("\\&") + c;
    } else {
      escaped += c;
    }
  }
  return escaped;
}

/// Examples and notes, line by line.
void write_footer(const CLI::App& command, std::ostream& out) {
  if (!command.get_footer().empty()) out << ".PP\n.nf\n" << literal(command.get_footer()) << "\n.fi\n";
}

void write_option(const CLI::Option& option, std::ostream& out) {
  const std::string name = option.get_positional() ? option.get_name(true) : option.get_name(false, true);
  out << ".TP\n\\fB" << literal(name) << "\\fR";
  const bool takes_value = option.get_items_expected_max() > 0;
  if (takes_value && !option.get_positional()) out << " \\fI" << literal(option.get_type_name()) << "\\fR";
  out << "\n" << literal(option.get_description());
  if (!option.get_default_str().empty()) out << " (default: " << literal(option.get_default_str()) << ")";
  out << "\n";
}

void write_commands(const CLI::App& parent, const std::string& words, std::ostream& out) {
  for (const CLI::App* command : parent.get_subcommands([](const CLI::App*) { return true; })) {
    const std::string name = words + " " + command->get_name();
    const bool leaf = command->get_subcommands([](const CLI::App*) { return true; }).empty();
    if (leaf) {
      out << ".SS " << literal(name) << "\n" << literal(command->get_description()) << ".\n";
      for (const CLI::Option* option : command->get_options()) {
        const std::string option_name = option->get_name();
        if (option_name != "--help" && option_name != "--help-all") write_option(*option, out);
      }
      write_footer(*command, out);
    }
    write_commands(*command, name, out);
  }
}

}  // namespace

std::string man_page(const CLI::App& program) {
  std::ostringstream out;
  out << ".TH STAIRWELL 1 \"\" \"stairwell " << kVersion << "\" \"User Commands\"\n"
      << ".SH NAME\nstairwell \\- explores unknown buildings with fleets of simulated UAVs\n"
      << ".SH SYNOPSIS\n.B stairwell\n.I COMMAND\n[\\fIOPTION\\fR]...\n"
      << ".SH DESCRIPTION\n"
      << literal(program.get_description()) << ", and leaves an OctoMap.\n"
      << "Lengths are metres, z is up. Every command knows \\fB\\-\\-help\\fR.\n"
      << ".SH COMMANDS\n";
  write_commands(program, "stairwell", out);
  out << ".SH EXAMPLES AND EXIT STATUS\n.nf\n"
      << literal(program.get_footer()) << "\n.fi\n"
      << ".SH FILES\n.TP\n.I share/stairwell/worlds\nWorlds to explore.\n"
      << ".TP\n.I share/stairwell/models\nWeights of the learned agents.\n"
      << ".PP\nBoth lie beside the folder of the program (\\fI/usr/share/stairwell\\fR of a Debian package).\n"
      << ".SH SEE ALSO\n.BR octovis (1),\n.BR ffmpeg (1)\n";
  return out.str();
}

}  // namespace stairwell::apps
