# cmake -DPROGRAM=PATH -DFOLDER=SHARE -P manual_page.cmake: a manual page and completions of a program whose --help is
# all that there is to say.
get_filename_component(name ${PROGRAM} NAME)
execute_process(COMMAND ${PROGRAM} --help OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCH "^[^\n]*: ([^\n]*)" title "${help}")
set(about "${CMAKE_MATCH_1}")
string(REPLACE "\\" "\\e" help "${help}")
string(REPLACE "-" "\\-" help "${help}")
string(REPLACE "\n." "\n\\&." help "${help}")
file(WRITE ${FOLDER}/man/man1/${name}.1
  ".TH ${name} 1\n.SH NAME\n${name} \\- ${about}\n.SH DESCRIPTION\n.nf\n${help}.fi\n")
file(WRITE ${FOLDER}/bash-completion/completions/${name} "complete -F _longopt ${name}  # bash-completion's own reader of --help\n")
file(WRITE ${FOLDER}/zsh/site-functions/_${name} "#compdef ${name}\n_gnu_generic\n")
