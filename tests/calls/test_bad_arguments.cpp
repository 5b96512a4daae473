// Promise 3: any argument is safe. Every function of sgrt.h is called with each of its arguments broken in every way of
// mutate.hpp, the inputs read-only and flush with memory that nobody may touch. Each call must give the very status
// that the rules or expected.txt state; outputs stay untouched where it is an error; nothing is written to stdout or
// stderr.
//
//   test_bad_arguments expected.txt            the test
//   test_bad_arguments expected.txt --observe  what every call gives, to review and to extend expected.txt
#include <fcntl.h>
#include <fnmatch.h>
#include <setjmp.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>

#include "mutate.hpp"

using namespace calls;

namespace {

constexpr int kLeastCalls = 5000;
char now_calling[256] = "building the world";
FILE* report = nullptr;  // stderr itself is watched
int failures = 0;

void failed(const std::string& where, const std::string& why) {
  if (++failures <= 200) std::fprintf(report, "%s: %s\n", where.c_str(), why.c_str());
}

sigjmp_buf after_crash;
bool observing = false;

void crashed(int signal_number) {
  if (observing) siglongjmp(after_crash, signal_number);
  std::fprintf(report, "signal %d in %s\n", signal_number, now_calling);
  _exit(3);
}

struct Rule {
  std::string function, where, what, status;
  mutable int used = 0;
};

// Lines `function where what[,what] status`, wildcards as the shell's; the last that fits holds.
std::vector<Rule> read_rules(const char* path) {
  std::vector<Rule> rules;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    Rule rule;
    std::string what;
    if (!(words >> rule.function >> rule.where >> what >> rule.status)) continue;
    std::istringstream parts(what);
    while (std::getline(parts, rule.what, ',')) rules.push_back(rule);
  }
  return rules;
}

bool fits(const std::string& pattern, const std::string& text) {
  return fnmatch(pattern.c_str(), text.c_str(), 0) == 0;
}

std::string plain(std::string text) {
  for (char& c : text) {
    if (c == '[') c = '<';
    if (c == ']') c = '>';
    if (c == ' ') c = '_';
  }
  return text;
}

std::string expected(const std::vector<Rule>& rules, const std::string& function, const std::string& where,
                     const std::string& what) {
  for (auto rule = rules.rbegin(); rule != rules.rend(); ++rule) {
    if (!fits(rule->function, function) || !fits(rule->where, where) || !fits(rule->what, what)) continue;
    ++rule->used;
    return rule->status;
  }
  return "invalid_argument";
}

// The word of a status; of a text whether there is one.
std::string word_of(const Function& f, const Answer& answer) {
  if (f.result == Function::kNothing) return "nothing";
  if (f.result == Function::kText) return answer.text ? "text" : "NULL";
  return sgrt_status_word(answer.status);
}

// Functions that write something whatever happens, as the header says.
bool writes_always(const std::string& function) {
  return function == "sgrt_stereo_session_push" || function == "sgrt_tof_session_push" ||
         function == "sgrt_tracker_push";
}

void check_call(const Function& f, Call& call, const std::string& name, const std::string& wanted) {
  const std::string before = sgrt_last_error();
  call.seal();
  const Answer answer = call.run();
  call.open();
  const std::string got = word_of(f, answer), message = sgrt_last_error();
  if (got != wanted) failed(name, "gives " + got + " (" + (answer.status ? message : "") + "), expected " + wanted);
  if (*call.outputs_off()) failed(name, call.outputs_off());
  const bool error = answer.status != 0 && (answer.status < 10 || answer.status > 19);
  if (error && !writes_always(f.name) && !call.outputs_untouched())
    failed(name, "an output was written in spite of " + got);
  if (answer.status != 0 && (message.empty() || message.find('\n') != std::string::npos))
    failed(name, "a message that is not one line: '" + message + "'");
  if (answer.status == SGRT_E_INTERNAL) failed(name, "an internal error: " + message);
}

int run_all(const std::vector<Rule>& rules, bool observe, const char* only) {
  static int calls_made = 0;  // static: longjmp
  for (const Function& f : functions()) {
    if (only && std::strcmp(only, f.name)) continue;
    std::vector<Mutation> all;
    {
      Call call(f);
      std::snprintf(now_calling, sizeof now_calling, "%s as its base call", f.name);
      all = mutations(f, call.args());
      check_call(f, call, f.name,
                 f.result == Function::kStatus ? "ok"
                 : f.result == Function::kText ? "text"
                                               : "nothing");
      ++calls_made;
    }
    for (const Mutation& m : all) {
      const std::string where = plain(m.where), what = plain(m.what), name = f.name + (" " + where + " " + what);
      std::snprintf(now_calling, sizeof now_calling, "%s", name.c_str());
      Call call(f);
      m.apply(call.args());
      ++calls_made;
      if (!observe) {
        check_call(f, call, name, expected(rules, f.name, where, what));
        continue;
      }
      const auto start = std::chrono::steady_clock::now();
      observing = true;
      if (sigsetjmp(after_crash, 1)) {
        std::fprintf(report, "%s CRASH\n", name.c_str());
        continue;
      }
      const Answer answer = call.run();
      const auto took = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
      std::fprintf(report, "%s %s # %.0f ms%s%s\n", name.c_str(), word_of(f, answer).c_str(), took,
                   answer.status ? " " : "", answer.status ? sgrt_last_error() : "");
    }
  }
  return calls_made;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) return 2;
  const bool observe = count > 2;
  report = fdopen(dup(observe ? 1 : 2), "w");
  setvbuf(report, nullptr, _IOLBF, 0);
  for (int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) signal(number, crashed);
  const std::vector<Rule> rules = read_rules(arguments[1]);
  build_world();
  const int quiet = quiet_streams();
  const int calls_made = run_all(rules, observe, count > 3 ? arguments[3] : nullptr);
  std::fflush(nullptr);
  if (lseek(quiet, 0, SEEK_END) != 0) failed("stdout and stderr", "something was written");
  free_world();
  if (observe) return 0;
  for (const Rule& rule : rules) {
    if (!rule.used) failed("expected.txt", rule.function + " " + rule.where + " " + rule.what + " fits no call");
  }
  if (calls_made < kLeastCalls) failed("calls", std::to_string(calls_made) + " are too few");
  std::fprintf(report, "%zu functions, %d calls, %d failures\n", functions().size(), calls_made, failures);
  return failures != 0;
}
