//! SVG drawings become the jobs that are written beside them; bad ones become clear errors.

#[cfg(test)]
mod bad_input;
#[cfg(test)]
mod checks;
#[cfg(test)]
mod damage;
#[cfg(test)]
mod hostile;
#[cfg(test)]
mod page;
#[cfg(test)]
mod shapes;
#[cfg(test)]
mod style;
#[cfg(test)]
mod text;
