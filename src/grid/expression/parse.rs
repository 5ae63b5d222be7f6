//! The parser of expressions: SQL conditions, restricted to arithmetic and comparisons.

use std::fmt::Display;

use sqlparser::ast::{
    BinaryOperator, CeilFloorKind, DateTimeField, Expr, Function, FunctionArg, FunctionArgExpr, FunctionArguments,
    Ident, Spanned, UnaryOperator, Value,
};
use sqlparser::dialect::PostgreSqlDialect;
use sqlparser::parser::{Parser, ParserError};
use sqlparser::tokenizer::Token;

use super::super::block::{Factor, Label};
use super::super::quantity::Quantity;
use super::program::{Binary, Expression, Op, Unary};
use crate::names::nearest;

/// Greatest length of an expression, in bytes. Chosen: a few lines of text. It bounds memory and depth.
const MAX_BYTES: usize = 1000;

/// Greatest number of nested parentheses. The time of `sqlparser` 0.62 doubles with each
/// nested function: `abs(abs(...))` takes milliseconds at 10, seconds at 18.
const MAX_NESTED_PARENTHESES: usize = 10;

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

    /// The fault of a name that is not in `known`.
    fn unknown(position: Option<u64>, what: &str, name: &str, known: &[&str]) -> Fault {
        let meant = nearest(name, known.iter().copied()).map(|meant| format!("did you mean `{meant}`?"));
        let help = meant.unwrap_or_else(|| "remove it, or choose one of these".to_owned());
        Fault::new(position, format!("unknown {what} `{name}`"), known.join(", "), help)
    }
}

/// Functions of one number. `log` follows SQL.
const UNARY: [(&str, Unary); 9] = [
    ("abs", Unary::Abs),
    ("sqrt", Unary::Sqrt),
    ("exp", Unary::Exp),
    ("ln", Unary::Ln),
    ("log10", Unary::Log10),
    ("log", Unary::Log10),
    ("floor", Unary::Floor),
    ("ceil", Unary::Ceil),
    ("ceiling", Unary::Ceil),
];

/// Functions of two numbers, in both spellings of SQL. All but powers take more arguments.
const BINARY: [(&str, Binary); 6] = [
    ("min", Binary::Min),
    ("least", Binary::Min),
    ("max", Binary::Max),
    ("greatest", Binary::Max),
    ("pow", Binary::Power),
    ("power", Binary::Power),
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
        let (expression, kind) = read(text, axes, None)?;
        if kind == Kind::Number {
            return Ok(expression);
        }
        let help = "use it in `where`, or compute a number";
        Err(Fault::new(None, format!("`{text}` is true or false"), "a number", help))
    }

    /// Parses a condition on `axes` and on the labels of `points`.
    ///
    /// # Errors
    ///
    /// A text that is not a condition on `axes` and labels.
    pub fn condition(text: &str, axes: &[Quantity], points: Option<&Factor>) -> Result<Expression, Fault> {
        let (expression, kind) = read(text, axes, points)?;
        if kind == Kind::Truth {
            return Ok(expression);
        }
        Err(Fault::new(None, format!("`{text}` is a number"), "true or false", "compare it, as in `v_f > v_i`"))
    }
}

/// The type of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Number,
    Truth,
}

fn read(text: &str, axes: &[Quantity], points: Option<&Factor>) -> Result<(Expression, Kind), Fault> {
    if text.len() > MAX_BYTES {
        let found = format!("{} characters", text.chars().count());
        return Err(Fault::new(None, found, format!("at most {MAX_BYTES}"), "shorten the expression"));
    }
    let mut nested = 0_usize;
    let deep = text.chars().position(|c| {
        match c {
            '(' => nested += 1,
            ')' => nested = nested.saturating_sub(1),
            _ => {}
        }
        nested > MAX_NESTED_PARENTHESES
    });
    if let Some(place) = deep {
        let expected = format!("at most {MAX_NESTED_PARENTHESES} nested");
        return Err(Fault::new(
            Some(place as u64 + 1),
            "parentheses nested too deeply",
            expected,
            "remove parentheses",
        ));
    }
    // The first two begin SQL comments, which would hide the rest.
    let foreign = [("--", "put a space or parentheses between"), ("/*", "remove it"), ("**", "write `^` for a power")];
    for (sign, help) in foreign {
        if let Some(place) = text.find(sign) {
            let position = text[..place].chars().count() as u64 + 1;
            return Err(Fault::new(Some(position), format!("unexpected `{sign}`"), GRAMMAR, help));
        }
    }
    // One line, so that a column is a position.
    let line: String = text.chars().map(|c| if c.is_whitespace() { ' ' } else { c }).collect();
    let parsed = Parser::new(&PostgreSqlDialect {}).try_with_sql(&line).and_then(|mut parser| {
        let expression = parser.parse_expr()?;
        Ok((expression, parser.next_token()))
    });
    let (expression, rest) = parsed.map_err(|error| syntax(&line, error))?;
    if rest.token != Token::EOF {
        let found = format!("`{}` after the end of `{expression}`", rest.token);
        let help = match rest.token {
            Token::Assignment | Token::SemiColon => "remove it",
            _ => "put an operator between, or remove it",
        };
        return Err(Fault::new(Some(rest.span.start.column), found, "nothing more", help));
    }
    let mut compiler = Compiler { line: &line, axes, points, program: Vec::new() };
    let kind = compiler.compile(&expression)?;
    Ok((Expression { program: compiler.program }, kind))
}

/// The message of the parser, simplified.
fn syntax(line: &str, error: ParserError) -> Fault {
    let message = match error {
        // Parentheses never reach it.
        ParserError::RecursionLimitExceeded => {
            return Fault::new(None, "operators nested too deeply", "fewer operators", "remove operators");
        }
        ParserError::TokenizerError(message) | ParserError::ParserError(message) => message,
    };
    let (said, column) = message.split_once(" at Line: 1, Column: ").unwrap_or((&message, ""));
    let position = column.trim().parse().ok();
    let said = said.replace("Expected: ", "expected ").replace("found: ", "found ");
    let (found, position) = if said.ends_with("EOF") {
        let end = line.chars().count() as u64 + 1;
        (
            if line.trim().is_empty() { "the expression is empty" } else { "the expression ends too early" }.to_owned(),
            Some(end),
        )
    } else {
        (said, position)
    };
    Fault::new(position, found, GRAMMAR, "correct the expression")
}

/// A number or a truth.
fn literal(value: &Value, expression: &Expr) -> Result<(f64, Kind), Fault> {
    match value {
        Value::Number(digits, false) => match digits.parse() {
            Ok(number) if f64::is_finite(number) => Ok((number, Kind::Number)),
            _ => {
                let found = format!("`{digits}` is beyond the range of numbers");
                Err(Fault::new(position(expression), found, "a number", "write `inf` for infinity"))
            }
        },
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
    line: &'a str,
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
        let wordy = |found: String, name: &dyn Display, word: &str| {
            Fault::new(position(expression), found, "a comparison with a word", format!("write `{name} = '{word}'`"))
        };
        if let Some((_, _, label)) = self.label(&name.value) {
            let word = label.words.first().map_or("", String::as_str);
            return Err(wordy(format!("`{name}` is a label"), name, word));
        }
        if name.quote_style.is_some() {
            return Err(foreign(expression));
        }
        let quantity = self.axis(&name.value, expression)?;
        match quantity.words().first() {
            Some(word) => Err(wordy(format!("`{}` is an axis of words", quantity.name()), &quantity.name(), word)),
            None => Ok(Op::Axis(quantity)),
        }
    }

    fn axis(&self, name: &str, expression: &Expr) -> Result<Quantity, Fault> {
        let known = self.axes.iter().copied().find(|quantity| quantity.name() == name);
        known.ok_or_else(|| {
            let known: Vec<&str> = self.axes.iter().map(|quantity| quantity.name()).collect();
            Fault::unknown(position(expression), "axis", name, &known)
        })
    }

    /// The label with this name: an axis of its factor, its number among the labels, and the label.
    fn label(&self, name: &str) -> Option<(Quantity, usize, &Label)> {
        let points = self.points?;
        let place = points.labels.iter().position(|label| label.name == name)?;
        Some((points.axes.first()?.quantity, place, &points.labels[place]))
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

    /// The fault of a comparison of `axis` with an unquoted word `other`.
    fn unquoted(&self, axis: &Expr, other: &Expr) -> Option<Fault> {
        let (Expr::Identifier(axis), Expr::Identifier(word)) = (axis, other) else { return None };
        let quantity = self.axes.iter().find(|quantity| quantity.name() == axis.value)?;
        let words = quantity.words();
        let is_axis = word.quote_style.is_none() && self.axes.iter().any(|quantity| quantity.name() == word.value);
        if words.is_empty() || is_axis {
            return None;
        }
        let meant = nearest(&word.value, words.iter().copied()).unwrap_or(words[0]);
        let known: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
        let help = format!("text goes in single quotes: `{} = '{meant}'`", quantity.name());
        Some(Fault::new(position(other), format!("`{other}` is not a word"), known.join(", "), help))
    }

    /// The equality of two numbers, or of an axis of words or a label with a word.
    fn equal(&mut self, left: &Expr, right: &Expr) -> Result<(), Fault> {
        for (axis, other) in [(left, right), (right, left)] {
            if let Some(fault) = self.unquoted(axis, other) {
                return Err(fault);
            }
        }
        let (axis, word, place) = match (word(left), word(right)) {
            (None, Some(word)) => (left, word, right),
            (Some(word), None) => (right, word, left),
            _ => {
                self.operand(left, Kind::Number)?;
                self.operand(right, Kind::Number)?;
                self.program.push(Op::Binary(Binary::Equal));
                return Ok(());
            }
        };
        let Expr::Identifier(name) = axis else { return Err(foreign(place)) };
        if let Some((axis, number, label)) = self.label(&name.value) {
            let Some(code) = label.words.iter().position(|known| known == word) else {
                let found = format!("no point has the {name} '{word}'");
                let meant = nearest(word, label.words.iter().map(String::as_str));
                let help = meant.map_or("correct the word".to_owned(), |meant| format!("did you mean `{meant}`?"));
                return Err(Fault::new(position(place), found, format!("a word of the column `{name}`"), help));
            };
            let label = Op::Label { label: number, axis };
            self.program.extend([label, Op::Number(code as f64), Op::Binary(Binary::Equal)]);
            return Ok(());
        }
        let quantity = self.axis(&name.value, axis)?;
        let words = quantity.words();
        let Some(number) = words.iter().position(|known| *known == word) else {
            if words.is_empty() {
                let found = format!("'{word}' is a word, `{}` a number", quantity.name());
                return Err(Fault::new(position(place), found, "a number", "remove the quotes"));
            }
            return Err(Fault::unknown(position(place), quantity.name(), word, &words));
        };
        self.program.extend([Op::Axis(quantity), Op::Number(number as f64), Op::Binary(Binary::Equal)]);
        Ok(())
    }

    fn binary(&mut self, whole: &Expr, left: &Expr, op: &BinaryOperator, right: &Expr) -> Result<Kind, Fault> {
        let (function, operands, kind) = match op {
            BinaryOperator::Plus => (Binary::Add, Kind::Number, Kind::Number),
            BinaryOperator::Minus => (Binary::Subtract, Kind::Number, Kind::Number),
            BinaryOperator::Multiply => (Binary::Multiply, Kind::Number, Kind::Number),
            BinaryOperator::Divide => (Binary::Divide, Kind::Number, Kind::Number),
            BinaryOperator::PGExp => {
                if matches!(left, Expr::BinaryOp { op: BinaryOperator::PGExp, .. }) {
                    let found = format!("`{whole}` can be read in two ways");
                    return Err(Fault::new(position(whole), found, "one power", "add parentheses, as in `(2^3)^2`"));
                }
                (Binary::Power, Kind::Number, Kind::Number)
            }
            BinaryOperator::Lt => (Binary::Less, Kind::Number, Kind::Truth),
            BinaryOperator::LtEq => (Binary::LessEqual, Kind::Number, Kind::Truth),
            BinaryOperator::Gt => (Binary::Greater, Kind::Number, Kind::Truth),
            BinaryOperator::GtEq => (Binary::GreaterEqual, Kind::Number, Kind::Truth),
            BinaryOperator::Eq | BinaryOperator::NotEq => {
                self.equal(left, right)?;
                self.program.extend((*op == BinaryOperator::NotEq).then_some(Op::Unary(Unary::Not)));
                return Ok(Kind::Truth);
            }
            BinaryOperator::And => (Binary::And, Kind::Truth, Kind::Truth),
            BinaryOperator::Or => (Binary::Or, Kind::Truth, Kind::Truth),
            _ => {
                let help = match op {
                    BinaryOperator::PGOverlap => "write `and`",
                    BinaryOperator::StringConcat => "write `or`",
                    _ => REMOVE,
                };
                return Err(Fault::new(self.operator(left, op), format!("unexpected `{op}`"), GRAMMAR, help));
            }
        };
        self.operand(left, operands)?;
        self.operand(right, operands)?;
        self.program.push(Op::Binary(function));
        Ok(kind)
    }

    /// The position of the operator after `left`.
    fn operator(&self, left: &Expr, op: &BinaryOperator) -> Option<u64> {
        // A span excludes parentheses.
        let end = left.span().end.column.saturating_sub(1);
        let rest: String = self.line.chars().skip(end as usize).collect();
        let place = rest.find(&op.to_string())?;
        Some(end + rest[..place].chars().count() as u64 + 1)
    }

    fn call(&mut self, name: &str, arguments: &[&Expr], whole: &Expr) -> Result<Kind, Fault> {
        let wrong = |count: &str| {
            let found = format!("`{name}` of {} numbers", arguments.len());
            Fault::new(position(whole), found, format!("`{name}` of {count}"), "correct the arguments")
        };
        if let Some((_, function)) = UNARY.iter().find(|(known, _)| *known == name) {
            let [argument] = arguments else { return Err(wrong("one number")) };
            self.operand(argument, Kind::Number)?;
            self.program.push(Op::Unary(*function));
        } else if let Some((_, function)) = BINARY.iter().find(|(known, _)| *known == name) {
            if arguments.len() < 2 || (*function == Binary::Power && arguments.len() > 2) {
                return Err(wrong(if *function == Binary::Power { "two numbers" } else { "two numbers or more" }));
            }
            for (place, argument) in arguments.iter().enumerate() {
                self.operand(argument, Kind::Number)?;
                self.program.extend((place > 0).then_some(Op::Binary(*function)));
            }
        } else {
            let known = UNARY.iter().map(|(name, _)| *name).chain(BINARY.iter().map(|(name, _)| *name));
            return Err(Fault::unknown(position(whole), "function", name, &known.collect::<Vec<_>>()));
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
    let help = match expression {
        _ if word(expression).is_some() => "compare an axis of words with it, as in `family = 'step'`",
        Expr::Identifier(_) => "names have no quotes; text goes in single quotes, as in `family = 'step'`",
        _ => REMOVE,
    };
    Fault::new(position(expression), format!("unexpected `{expression}`"), GRAMMAR, help)
}
