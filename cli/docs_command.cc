// SPDX-License-Identifier: BSD-3-Clause
// Man pages and bash completion, made of what --help is made of. Run by the build; --help does not list it.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "command.h"
#include "output.h"

namespace isoreel::cli {
namespace {

/// Text as roff takes it.
std::string roff(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else if ((c == '.' || c == '\'') && (result.empty() || result.back() == '\n')) {
      result += std::string("\\&") + c;
    } else {
      result += c;
    }
  }
  return result;
}

/// "-o, --output"
std::string namesOf(const CLI::Option& option) {
  if (option.get_positional()) return option.get_name(true);
  std::string names;
  for (const std::string& name : option.get_snames()) names += (names.empty() ? "-" : ", -") + name;
  for (const std::string& name : option.get_lnames()) names += (names.empty() ? "--" : ", --") + name;
  return names;
}

std::string manEntry(const CLI::Option& option) {
  std::string entry = fmt::format(".TP\n\\fB{}\\fR", roff(namesOf(option)));
  const bool takes_value = option.get_expected_max() > 0;
  if (takes_value && !option.get_type_name().empty())
    entry += fmt::format(" \\fI{}\\fR", roff(option.get_type_name()));
  if (option.get_expected_max() > 1) entry += " ...";
  entry += "\n" + roff(option.get_description()) + ".\n";
  if (takes_value && !option.get_default_str().empty())
    entry += fmt::format("Default: {}.\n", roff(option.get_default_str()));
  if (option.get_required()) entry += "Required.\n";
  for (const CLI::Option* other : option.get_excludes())
    entry += fmt::format("Not with {}.\n", roff(namesOf(*other)));
  return entry;
}

/// Verbs that --help lists.
std::vector<const CLI::App*> verbsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* verb) { return !verb->get_group().empty(); });
}

std::string page(const std::string& name, const CLI::App& verb) {
  std::string command = name;
  std::replace(command.begin(), command.end(), '-', ' ');
  std::string text = fmt::format(".TH {} 1 \"\" \"Isoreel {}\" \"Isoreel\"\n.SH NAME\n{} \\- {}\n", name,
                                 ISOREEL_VERSION, roff(name), roff(verb.get_description()));
  text += fmt::format(".SH SYNOPSIS\n\\fB{}\\fR [\\fIoptions\\fR]", command);
  std::string arguments, options;
  for (const CLI::Option* option : verb.get_options()) {
    (option->get_positional() ? arguments : options) += manEntry(*option);
    if (option->get_positional()) {
      const std::string pages = fmt::format("\\fI{}\\fR{}", roff(option->get_name(true)),
                                            option->get_expected_max() > 1 ? "..." : "");
      text += option->get_required() ? " " + pages : fmt::format(" [{}]", pages);
    }
  }
  if (!verbsOf(verb).empty()) text += " \\fIverb\\fR ...";
  text += "\n";
  if (!arguments.empty()) text += ".SH ARGUMENTS\n" + arguments;
  text += ".SH OPTIONS\n" + options;
  if (!verbsOf(verb).empty()) text += ".SH VERBS\n";
  for (const CLI::App* each : verbsOf(verb))
    text += fmt::format(".TP\n\\fB{}\\fR\n{}.\nSee \\fBisoreel\\-{}\\fR(1).\n", each->get_name(),
                        roff(each->get_description()), each->get_name());
  if (!verb.get_footer().empty()) text += roff(verb.get_footer()) + "\n";
  text += ".SH EXIT STATUS\n0 fine, 1 failed, 2 wrong usage.\n.SH SEE ALSO\n\\fBisoreel\\fR(1)\n";
  return text;
}

/// What an option may be given, where its type lists that: "a|b" or "TEXT:{a,b}".
std::string choicesOf(const CLI::Option& option) {
  std::string type = option.get_type_name();
  if (const std::size_t brace = type.find('{'); brace != std::string::npos) {
    type = type.substr(brace + 1, type.find('}') - brace - 1);
    std::replace(type.begin(), type.end(), ',', ' ');
    return type;
  }
  if (type.find('|') == std::string::npos || type.find(' ') != std::string::npos) return "";
  std::replace(type.begin(), type.end(), '|', ' ');
  return type;
}

std::string completion(const CLI::App& app) {
  std::string verbs, options, values;
  for (const CLI::App* verb : verbsOf(app)) {
    verbs += verb->get_name() + " ";
    std::string words;
    for (const CLI::Option* option : verb->get_options()) {
      std::string patterns;
      for (const std::string& name : option->get_lnames()) {
        words += "--" + name + " ";
        patterns += fmt::format("{}'{} --{}'", patterns.empty() ? "" : " | ", verb->get_name(), name);
      }
      const std::string choices = choicesOf(*option);
      if (!choices.empty() && !patterns.empty())
        values += fmt::format("    {}) words='{}' ;;\n", patterns, choices);
    }
    options += fmt::format("      {}) words='{}' ;;\n", verb->get_name(), words);
  }
  return fmt::format(
      R"(# bash completion of isoreel: verbs, options, and values where an option lists them; file names for the rest.
# Made by the build.
_isoreel() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} verb=${{COMP_WORDS[1]}} words=
  [[ $current == = ]] && current=
  [[ $before == = ]] && before=${{COMP_WORDS[COMP_CWORD - 2]}}
  case "$verb $before" in
{}  esac
  if ((COMP_CWORD == 1)); then
    words='{}--help --version'
  elif [[ -z $words && $current == -* ]]; then
    case "$verb" in
{}    esac
  fi
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _isoreel isoreel
)",
      values, verbs, options);
}

Status save(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (file.flush()) return {};
  return {ErrorCode::kIo, path.string() + ": cannot be written"};
}

Status docs(const CLI::App& app, const std::filesystem::path& folder, bool force) {
  std::vector<std::pair<std::string, std::string>> files{{"isoreel.1", page("isoreel", app)},
                                                         {"isoreel.bash", completion(app)}};
  for (const CLI::App* verb : verbsOf(app))
    files.emplace_back("isoreel-" + verb->get_name() + ".1", page("isoreel-" + verb->get_name(), *verb));
  for (const auto& [name, text] : files) ISOREEL_TRY(mayWrite(folder / name, force));
  for (const auto& [name, text] : files) ISOREEL_TRY(save(folder / name, text));
  return {};
}

}  // namespace

void addDocsCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("docs", "Man pages and bash completion, into a folder that is there");
  verb->group("");
  struct DocsOptions {
    std::string folder;
    bool force = false;
  };
  const auto options = std::make_shared<DocsOptions>();
  verb->add_option("folder", options->folder, "Where to")->required();
  verb->add_flag("--force", options->force, "Replace files that are there");
  verb->callback([&app, options, &chosen] {
    chosen = [&app, options] { return docs(app, options->folder, options->force); };
  });
}

}  // namespace isoreel::cli
