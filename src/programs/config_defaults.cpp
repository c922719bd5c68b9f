#include "programs/config_defaults.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <map>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr std::array<std::string_view, 3> kPrograms{"synth", "corpus", "retarget"};

std::string optionOf(const ConfigEntry& entry) { return "--" + entry.key; }

/// The commands of `app` that a section is of, itself among them; none of another program's section.
std::vector<const CLI::App*> commandsOf(const CLI::App& app, const std::string& section) {
  std::vector<const CLI::App*> commands;
  const bool is_whole = section == app.get_name();
  if (is_whole) commands.push_back(&app);
  for (const CLI::App* each : app.get_subcommands(nullptr)) {
    if (is_whole || section == app.get_name() + " " + each->get_name()) commands.push_back(each);
  }
  return commands;
}

/// Whether `value` stands in `text` with no letter or digit beside it.
bool holdsWord(std::string_view text, std::string_view value) {
  const auto isOfWord = [&](std::size_t at) {
    return at < text.size() && std::isalnum(static_cast<unsigned char>(text[at])) != 0;
  };
  for (std::size_t at = text.find(value); at != std::string_view::npos; at = text.find(value, at + 1)) {
    if ((at == 0 || !isOfWord(at - 1)) && !isOfWord(at + value.size())) return true;
  }
  return false;
}

}  // namespace

ConfigDefaults::ConfigDefaults(const CLI::App& app, const std::vector<std::string>& arguments) : file_(configPath()) {
  const CLI::App* command = &app;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument.starts_with('-')) {
      const CLI::Option* option = app.get_option_no_throw(argument);
      if (option != nullptr && option->get_items_expected_max() > 0) ++i;  // its value
      continue;
    }
    for (const CLI::App* each : app.get_subcommands(nullptr)) {
      if (each->get_name() == argument) command = each;
    }
    break;
  }
  has_command_ = command != &app;
  const auto isGiven = [&](const CLI::Option* option) {
    return std::any_of(arguments.begin(), arguments.end(), [&](const std::string& argument) {
      const bool is_short = argument.size() > 2 && argument[0] == '-' && argument[1] != '-';  // "-j1"
      const std::string name = argument.substr(0, is_short ? 2 : argument.find('='));
      return name.starts_with('-') && option->check_name(name);
    });
  };
  const std::vector<ConfigEntry> all = readConfig(file_);
  // What another default of this command gives is there, too.
  const auto isThere = [&](const CLI::Option* option) {
    return isGiven(option) || std::any_of(all.begin(), all.end(), [&](const ConfigEntry& entry) {
             const std::vector<const CLI::App*> commands = commandsOf(app, entry.section);
             return option->check_name(optionOf(entry)) &&
                    std::find(commands.begin(), commands.end(), command) != commands.end();
           });
  };
  std::map<std::string, ConfigEntry> found;  // of a command's own section before the program's
  for (const ConfigEntry& entry : all) {
    const std::vector<const CLI::App*> commands = commandsOf(app, entry.section);
    const std::string program = entry.section.substr(0, entry.section.find(' '));
    if (commands.empty() && program != app.get_name() && std::ranges::find(kPrograms, program) != kPrograms.end())
      continue;
    if (commands.empty())
      throw InputError(file_.string(), std::to_string(entry.section_line),
                       fmt::format("found '[{}]'; expected [synth], [corpus], [retarget], or a command of them, as "
                                   "[synth batch]",
                                   printable(entry.section)));
    const std::string name = optionOf(entry);
    if (std::none_of(commands.begin(), commands.end(),
                     [&](const CLI::App* each) { return each->get_option_no_throw(name) != nullptr; }))
      throw InputError(file_.string(), std::to_string(entry.line),
                       fmt::format("found '{}'; expected an option of {}", printable(entry.key), entry.section));
    const CLI::Option* option = command->get_option_no_throw(name);
    if (option == nullptr || std::find(commands.begin(), commands.end(), command) == commands.end() || isGiven(option))
      continue;
    const bool is_refused = option->get_group().empty();  // by a command that shares options with others
    if (is_refused && commands.size() > 1) continue;
    const auto excluded = option->get_excludes();
    const auto needed = option->get_needs();
    if (std::any_of(excluded.begin(), excluded.end(), isGiven) || !std::all_of(needed.begin(), needed.end(), isThere))
      continue;
    const auto [first, is_new] = found.try_emplace(name, entry);
    if (!is_new && (commands.size() == 1 || first->second.section == entry.section)) first->second = entry;
  }
  for (auto& [name, entry] : found) entries_.push_back(std::move(entry));
}

std::vector<std::string> ConfigDefaults::before(std::vector<std::string> arguments) const {
  std::vector<std::string> given;
  for (const ConfigEntry& entry : entries_) given.push_back(optionOf(entry) + "=" + entry.value);
  arguments.insert(arguments.begin() + (has_command_ ? 1 : 0), given.begin(), given.end());
  return arguments;
}

bool ConfigDefaults::has(std::string_view option) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const ConfigEntry& entry) { return optionOf(entry) == option; });
}

std::string ConfigDefaults::placed(const std::string& message) const {
  for (const ConfigEntry& entry : entries_) {
    const std::string name = optionOf(entry);
    if (message.starts_with(name + ":") || message.starts_with(name + " "))
      return fmt::format("{}:{}: {}", file_.string(), entry.line, message);
  }
  for (const ConfigEntry& entry : entries_) {
    // A number or a word such as "auto" may be another's.
    const bool is_name = entry.value.find_first_of("/.:") != std::string::npos && entry.value.size() > 2;
    if (message.find("'" + entry.value + "'") != std::string::npos || (is_name && holdsWord(message, entry.value)))
      return fmt::format("{} ({} of {}:{})", message, entry.key, file_.string(), entry.line);
  }
  return message;
}

}  // namespace mouthpiece
