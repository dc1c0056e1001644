//! The command line's entry: parse, run, turn the outcome into an exit code.

fn main() -> std::process::ExitCode {
    slipwatch::cli::main()
}
