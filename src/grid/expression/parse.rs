//! The parser of expressions: SQL conditions, restricted to arithmetic and comparisons.

use sqlparser::ast::{
    BinaryOperator, CeilFloorKind, DateTimeField, Expr, Function, FunctionArg, FunctionArgExpr, FunctionArguments,
    Ident, Spanned, UnaryOperator, Value,
};
use sqlparser::dialect::PostgreSqlDialect;
use sqlparser::parser::{Parser, ParserError};
use sqlparser::tokenizer::Token;

use super::super::block::Factor;
use super::super::quantity::Quantity;
use super::program::{Binary, Expression, Op, Unary};
use crate::names::hint_or;

/// Greatest length of an expression, in bytes. Chosen: a few lines of text. It bounds memory and depth.
const MAX_BYTES: usize = 1000;

/// Greatest number of nested parentheses. The time of `sqlparser` 0.62 doubles with each
/// nested function: `abs(abs(...))` takes milliseconds at 10, seconds at 18.
const MAX_NESTED_PARENTHESES: i32 = 10;

/// Greatest number of names in a message: labels of points may have millions of words. Chosen: two lines of text.
const MAX_SHOWN_NAMES: usize = 20;

/// The fault of an expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Its position, in characters from 1; `None` for the whole expression.
    pub position: Option<u64>,
    /// The finding.
    pub found: String,
    /// The expected input.
    pub expected: String,
    /// The help.
    pub help: String,
}

impl Fault {
    fn new(
        position: Option<u64>,
        found: impl Into<String>,
        expected: impl Into<String>,
        help: impl Into<String>,
    ) -> Fault {
        Fault { position, found: found.into(), expected: expected.into(), help: help.into() }
    }

    /// The fault with the position of its sign in `text`, or of the end, unless it has one.
    fn located(self, text: &str) -> Fault {
        let sign = self.found.strip_prefix("unexpected `").and_then(|sign| sign.strip_suffix('`'));
        let place = match sign {
            Some(sign) => text.find(sign),
            None => self.found.ends_with(END).then_some(text.len()),
        };
        let position = || Some(text[..place?].chars().count() as u64 + 1);
        Fault { position: self.position.or_else(position), ..self }
    }

    /// The fault of a name that is not in `known`.
    fn unknown(position: Option<u64>, what: &str, name: &str, known: &[&str]) -> Fault {
        let help = hint_or(name, known.iter().copied(), "remove it, or choose one of these");
        let shown = known[..known.len().min(MAX_SHOWN_NAMES)].join(", ");
        let expected = if known.len() > MAX_SHOWN_NAMES { format!("{shown}, ...") } else { shown };
        Fault::new(position, format!("unknown {what} `{name}`"), expected, help)
    }
}

/// Functions, in both spellings of SQL. `log` follows SQL. Minimum and maximum take two or more arguments.
const FUNCTIONS: [(&str, Op); 15] = [
    ("abs", Op::Unary(Unary::Abs)),
    ("sqrt", Op::Unary(Unary::Sqrt)),
    ("exp", Op::Unary(Unary::Exp)),
    ("ln", Op::Unary(Unary::Ln)),
    ("log10", Op::Unary(Unary::Log10)),
    ("log", Op::Unary(Unary::Log10)),
    ("floor", Op::Unary(Unary::Floor)),
    ("ceil", Op::Unary(Unary::Ceil)),
    ("ceiling", Op::Unary(Unary::Ceil)),
    ("min", Op::Binary(Binary::Min)),
    ("least", Op::Binary(Binary::Min)),
    ("max", Op::Binary(Binary::Max)),
    ("greatest", Op::Binary(Binary::Max)),
    ("pow", Op::Binary(Binary::Power)),
    ("power", Op::Binary(Binary::Power)),
];

/// Operators but for equality, with the types of their operands and of their value.
const OPERATORS: [(BinaryOperator, Binary, Kind, Kind); 11] = [
    (BinaryOperator::Plus, Binary::Add, Kind::Number, Kind::Number),
    (BinaryOperator::Minus, Binary::Subtract, Kind::Number, Kind::Number),
    (BinaryOperator::Multiply, Binary::Multiply, Kind::Number, Kind::Number),
    (BinaryOperator::Divide, Binary::Divide, Kind::Number, Kind::Number),
    (BinaryOperator::PGExp, Binary::Power, Kind::Number, Kind::Number),
    (BinaryOperator::Lt, Binary::Less, Kind::Number, Kind::Truth),
    (BinaryOperator::LtEq, Binary::LessEqual, Kind::Number, Kind::Truth),
    (BinaryOperator::Gt, Binary::Greater, Kind::Number, Kind::Truth),
    (BinaryOperator::GtEq, Binary::GreaterEqual, Kind::Number, Kind::Truth),
    (BinaryOperator::And, Binary::And, Kind::Truth, Kind::Truth),
    (BinaryOperator::Or, Binary::Or, Kind::Truth, Kind::Truth),
];

/// The grammar, for messages.
const GRAMMAR: &str = "axes, numbers, + - * / ^, comparisons, and, or, not, in (...), between, abs, sqrt, exp, ln (natural logarithm), \
                       log or log10 (to base 10), floor, ceil, min, max, pow";

impl Expression {
    /// Parses a number computed from `axes`.
    ///
    /// # Errors
    ///
    /// A text that is not a number computed from `axes`.
    pub fn number(text: &str, axes: &[Quantity]) -> Result<Expression, Fault> {
        read(text, axes, None, Kind::Number)
    }

    /// Parses a condition on `axes` and on the labels of `points`.
    ///
    /// # Errors
    ///
    /// A text that is not a condition on `axes` and labels.
    pub fn condition(text: &str, axes: &[Quantity], points: Option<&Factor>) -> Result<Expression, Fault> {
        read(text, axes, points, Kind::Truth)
    }
}

/// The type of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Number,
    Truth,
}

fn read(text: &str, axes: &[Quantity], points: Option<&Factor>, wanted: Kind) -> Result<Expression, Fault> {
    let (expression, kind) = parse(text, axes, points).map_err(|fault| fault.located(text))?;
    let (is, expected, help) = match kind {
        kind if kind == wanted => return Ok(expression),
        Kind::Truth => ("true or false", "a number", "use it in `where`, or compute a number"),
        Kind::Number => ("a number", "true or false", "compare it, as in `v_f > v_i`"),
    };
    Err(Fault::new(None, format!("`{text}` is {is}"), expected, help))
}

fn parse(text: &str, axes: &[Quantity], points: Option<&Factor>) -> Result<(Expression, Kind), Fault> {
    if text.len() > MAX_BYTES {
        let found = format!("{} characters", text.chars().count());
        return Err(Fault::new(None, found, format!("at most {MAX_BYTES}"), "shorten the expression"));
    }
    let depths = text.bytes().scan(0, |depth, byte| {
        *depth += i32::from(byte == b'(') - i32::from(byte == b')');
        Some(*depth)
    });
    if depths.max() > Some(MAX_NESTED_PARENTHESES) {
        let expected = format!("at most {MAX_NESTED_PARENTHESES} nested");
        return Err(Fault::new(None, "parentheses nested too deeply", expected, "remove parentheses"));
    }
    // The first two begin SQL comments, which would hide the rest.
    let foreign = [("--", "put a space or parentheses between"), ("/*", "remove it"), ("**", "write `^` for a power")];
    if let Some((sign, help)) = foreign.into_iter().find(|(sign, _)| text.contains(sign)) {
        return Err(Fault::new(None, format!("unexpected `{sign}`"), GRAMMAR, help));
    }
    // One line, so that a column is a position.
    let line: String = text.chars().map(|c| if c.is_whitespace() { ' ' } else { c }).collect();
    let parsed = Parser::new(&PostgreSqlDialect {}).try_with_sql(&line).and_then(|mut parser| {
        let expression = parser.parse_expr()?;
        Ok((expression, parser.next_token()))
    });
    let (expression, rest) = parsed.map_err(|error| syntax(&error))?;
    if rest.token != Token::EOF {
        let found = format!("`{}` after the end of `{expression}`", rest.token);
        let help = "put an operator between, or remove it";
        return Err(Fault::new(Some(rest.span.start.column), found, "nothing more", help));
    }
    let mut compiler = Compiler { axes, points, program: Vec::new() };
    let kind = compiler.compile(&expression)?;
    Ok((Expression { program: compiler.program }, kind))
}

/// The end of an expression, in messages.
const END: &str = "the end of the expression";

/// The message of the parser, simplified.
fn syntax(error: &ParserError) -> Fault {
    let message = error.to_string().replace("sql parser error: ", "").replace("Expected: ", "expected ");
    let message = message.replace("found: ", "found ").replace("EOF", END);
    let (found, column) = message.split_once(" at Line: 1, Column: ").unwrap_or((&message, ""));
    Fault::new(column.trim().parse().ok(), found, GRAMMAR, "correct the expression")
}

/// A number or a truth.
fn literal(value: &Value, expression: &Expr) -> Result<(f64, Kind), Fault> {
    match value {
        Value::Number(digits, false) => {
            let number = digits.parse().ok().filter(|number| f64::is_finite(*number));
            number.map(|number| (number, Kind::Number)).ok_or_else(|| foreign(expression))
        }
        Value::Boolean(is) => Ok((f64::from(u8::from(*is)), Kind::Truth)),
        _ => Err(foreign(expression)),
    }
}

/// Name and arguments of a plain function call.
fn plain(call: &Function) -> Option<(&str, Vec<&Expr>)> {
    let is_plain = call.filter.is_none() && call.over.is_none() && call.within_group.is_empty();
    let FunctionArguments::List(list) = &call.args else { return None };
    let arguments = list.args.iter().map(|argument| match argument {
        FunctionArg::Unnamed(FunctionArgExpr::Expr(expression)) => Some(expression),
        _ => None,
    });
    let name = call.name.0.first().filter(|_| is_plain)?.as_ident()?;
    Some((name.value.as_str(), arguments.collect::<Option<_>>()?))
}

struct Compiler<'a> {
    axes: &'a [Quantity],
    points: Option<&'a Factor>,
    program: Vec<Op>,
}

impl Compiler<'_> {
    fn compile(&mut self, expression: &Expr) -> Result<Kind, Fault> {
        match expression {
            Expr::Nested(inner) => self.compile(inner),
            Expr::Identifier(name) => {
                let operand = self.name(name, expression)?;
                self.program.push(operand);
                Ok(Kind::Number)
            }
            Expr::Value(value) => {
                let (number, kind) = literal(&value.value, expression)?;
                self.program.push(Op::Number(number));
                Ok(kind)
            }
            Expr::UnaryOp { op, expr } => {
                let (function, kind) = match op {
                    UnaryOperator::Minus => (Some(Unary::Negate), Kind::Number),
                    UnaryOperator::Plus => (None, Kind::Number),
                    UnaryOperator::Not => (Some(Unary::Not), Kind::Truth),
                    _ => return Err(foreign(expression)),
                };
                self.operand(expr, kind)?;
                self.program.extend(function.map(Op::Unary));
                Ok(kind)
            }
            Expr::BinaryOp { left, op, right } => self.binary(expression, left, op, right),
            Expr::Between { expr, negated, low, high } => {
                for (bound, comparison) in [(low, Binary::GreaterEqual), (high, Binary::LessEqual)] {
                    self.operand(expr, Kind::Number)?;
                    self.operand(bound, Kind::Number)?;
                    self.program.push(Op::Binary(comparison));
                }
                self.program.push(Op::Binary(Binary::And));
                self.program.extend(negated.then_some(Op::Unary(Unary::Not)));
                Ok(Kind::Truth)
            }
            Expr::InList { expr, list, negated } if !list.is_empty() => {
                for (place, value) in list.iter().enumerate() {
                    self.equal(expr, value)?;
                    self.program.extend((place > 0).then_some(Op::Binary(Binary::Or)));
                }
                self.program.extend(negated.then_some(Op::Unary(Unary::Not)));
                Ok(Kind::Truth)
            }
            Expr::Function(call) => {
                let (name, arguments) = plain(call).ok_or_else(|| foreign(expression))?;
                self.call(name, &arguments, expression)
            }
            // The grammar treats these two as operators.
            Expr::Floor { expr, field: CeilFloorKind::DateTimeField(DateTimeField::NoDateTime) } => {
                self.call("floor", &[expr], expression)
            }
            Expr::Ceil { expr, field: CeilFloorKind::DateTimeField(DateTimeField::NoDateTime) } => {
                self.call("ceil", &[expr], expression)
            }
            _ => Err(foreign(expression)),
        }
    }

    /// The value of a name in a numeric position.
    fn name(&self, name: &Ident, expression: &Expr) -> Result<Op, Fault> {
        // Infinity is not an axis.
        if name.value == "inf" {
            return Ok(Op::Number(f64::INFINITY));
        }
        let (operand, words) = self.variable(name, expression)?;
        let Some(word) = words.first() else { return Ok(operand) };
        let what = if matches!(operand, Op::Label { .. }) { "a label" } else { "an axis of words" };
        let help = format!("write `{} = '{word}'`", name.value);
        Err(Fault::new(position(expression), format!("`{}` is {what}", name.value), "a comparison with a word", help))
    }

    /// The values of an axis or a label, and its words; an axis of numbers has none.
    fn variable(&self, name: &Ident, expression: &Expr) -> Result<(Op, Vec<&str>), Fault> {
        if let Some(points) = self.points
            && let Some(label) = points.labels.iter().position(|label| label.name == name.value)
            && let Some(axis) = points.axes.first()
        {
            let words = points.labels[label].words.iter().map(String::as_str).collect();
            return Ok((Op::Label { label, axis: axis.quantity }, words));
        }
        match self.axes.iter().find(|quantity| quantity.name() == name.value) {
            Some(quantity) => Ok((Op::Axis(*quantity), quantity.words())),
            None => {
                let labels = self.points.iter().flat_map(|points| &points.labels).map(|label| label.name.as_str());
                let known: Vec<&str> = labels.chain(self.axes.iter().map(|quantity| quantity.name())).collect();
                Err(Fault::unknown(position(expression), "axis", &name.value, &known))
            }
        }
    }

    fn operand(&mut self, expression: &Expr, wanted: Kind) -> Result<(), Fault> {
        let found = self.compile(expression)?;
        if found == wanted {
            return Ok(());
        }
        let (is, expected, help) = match found {
            Kind::Truth => {
                ("true or false", "a number", "write each comparison on its own, as in `1 < v_i and v_i < 3`")
            }
            Kind::Number => ("a number", "true or false", "compare it, as in `v_f > 3`"),
        };
        Err(Fault::new(position(expression), format!("`{expression}` is {is}"), expected, help))
    }

    /// The equality of two numbers, or of an axis of words or a label with a word.
    fn equal(&mut self, left: &Expr, right: &Expr) -> Result<(), Fault> {
        let (variable, word, place) = match (word(left), word(right)) {
            (None, Some(word)) => (left, word, right),
            (Some(word), None) => (right, word, left),
            _ => {
                self.operand(left, Kind::Number)?;
                self.operand(right, Kind::Number)?;
                self.program.push(Op::Binary(Binary::Equal));
                return Ok(());
            }
        };
        let Expr::Identifier(name) = variable else { return Err(foreign(place)) };
        let (variable, words) = self.variable(name, variable)?;
        if words.is_empty() {
            let found = format!("'{word}' is a word, `{name}` a number");
            return Err(Fault::new(position(place), found, "a number", "remove the quotes"));
        }
        let Some(code) = words.iter().position(|known| *known == word) else {
            return Err(Fault::unknown(position(place), &name.value, word, &words));
        };
        self.program.extend([variable, Op::Number(code as f64), Op::Binary(Binary::Equal)]);
        Ok(())
    }

    fn binary(&mut self, whole: &Expr, left: &Expr, op: &BinaryOperator, right: &Expr) -> Result<Kind, Fault> {
        if matches!(op, BinaryOperator::Eq | BinaryOperator::NotEq) {
            self.equal(left, right)?;
            self.program.extend((*op == BinaryOperator::NotEq).then_some(Op::Unary(Unary::Not)));
            return Ok(Kind::Truth);
        }
        let is_power = |op: &BinaryOperator| *op == BinaryOperator::PGExp;
        if is_power(op) && matches!(left, Expr::BinaryOp { op, .. } if is_power(op)) {
            let found = format!("`{whole}` can be read in two ways");
            return Err(Fault::new(position(whole), found, "one power", "add parentheses, as in `(2^3)^2`"));
        }
        let Some((_, function, operands, kind)) = OPERATORS.into_iter().find(|(known, ..)| known == op) else {
            let help = match op {
                BinaryOperator::PGOverlap => "write `and`",
                BinaryOperator::StringConcat => "write `or`",
                _ => REMOVE,
            };
            return Err(Fault::new(None, format!("unexpected `{op}`"), GRAMMAR, help));
        };
        self.operand(left, operands)?;
        self.operand(right, operands)?;
        self.program.push(Op::Binary(function));
        Ok(kind)
    }

    fn call(&mut self, name: &str, arguments: &[&Expr], whole: &Expr) -> Result<Kind, Fault> {
        let Some((_, function)) = FUNCTIONS.iter().find(|(known, _)| *known == name) else {
            return Err(Fault::unknown(position(whole), "function", name, &FUNCTIONS.map(|(name, _)| name)));
        };
        let (counts, expected) = match function {
            Op::Unary(_) => (1..=1, "one number"),
            Op::Binary(Binary::Power) => (2..=2, "two numbers"),
            _ => (2..=usize::MAX, "two numbers or more"),
        };
        if !counts.contains(&arguments.len()) {
            let (found, expected) =
                (format!("`{name}` of {} numbers", arguments.len()), format!("`{name}` of {expected}"));
            return Err(Fault::new(position(whole), found, expected, "correct the arguments"));
        }
        for (place, argument) in arguments.iter().enumerate() {
            self.operand(argument, Kind::Number)?;
            self.program.extend((place > 0 || arguments.len() == 1).then_some(*function));
        }
        Ok(Kind::Number)
    }
}

fn word(expression: &Expr) -> Option<&str> {
    match expression {
        Expr::Value(value) => match &value.value {
            Value::SingleQuotedString(word) => Some(word),
            _ => None,
        },
        Expr::Nested(inner) => word(inner),
        _ => None,
    }
}

fn position(expression: &Expr) -> Option<u64> {
    let column = expression.span().start.column;
    (column > 0).then_some(column)
}

/// The help for unsupported syntax.
const REMOVE: &str = "remove it, or use the listed elements";

/// The fault of SQL syntax that is not supported here.
fn foreign(expression: &Expr) -> Fault {
    let is_word = word(expression).is_some();
    let help = if is_word { "compare an axis of words with it, as in `family = 'step'`" } else { REMOVE };
    Fault::new(position(expression), format!("unexpected `{expression}`"), GRAMMAR, help)
}
